# SPDX-License-Identifier: Apache-2.0
"""What a user says about a scene beside its file: options, or a small YAML file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import tyro

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.yaml_file import read_yaml

#: Keys whose order counts; kept as rows, as equal mappings may differ in their order.
_RULES = ("materials", "object_materials")

_Names = tyro.conf.UseAppendAction[tuple[str, ...]]


@dataclass(frozen=True)
class SceneOptions:
    """What to make of a scene; what is said here goes before the file and before guesses.

    NAME may be a pattern (*, ?, [abc]); repeat an option for several.
    """

    scene_config: Path | None = None
    """YAML file with these and more: see `rfgs-factory check --help`."""
    frame_range: str = ""
    """First and last frame A:B of the scene, in place of the file's own."""
    fps: float | None = None
    """Frames per second."""
    unit_scale: float | None = None
    """Metres per Blender unit, 0.01 for a file drawn in centimetres."""
    bounds: tuple[float, float, float, float, float, float] | None = None
    """Box X0 Y0 Z0 X1 Y1 Z1 that radio sees [m]; what is static is cut there."""
    drop: _Names = ()
    """Object or device NAME to leave out, of radio and of pictures."""
    people: _Names = ()
    """Object NAME that is a person."""
    vehicles: _Names = ()
    """Object NAME that is a vehicle."""
    moving: _Names = ()
    """Object NAME that counts as moving although it may keep still."""
    material: _Names = ()
    """NAME=MATERIAL: radio material of a Blender material."""
    object_material: _Names = ()
    """NAME=MATERIAL: radio material of an object."""
    ring: int | None = None
    """So many cameras in a ring around what moves, in place of the file's own."""
    room: str | None = None
    """`box` builds a plain room of plasterboard around the scene."""


def read_options(options: SceneOptions) -> dict[str, Any]:
    """Options laid over the YAML file, in the words of the file.

    Values are judged by the add-on, which knows the scene. Rules about materials come as rows of
    pattern and material: of two that fit the first decides, so their order is part of a plan.

    Raises:
        RfgsError: There is no such file, or an option has no `=`.
        RfgsFormatError: The file is no YAML mapping, or a value is no text or finite number.
    """
    source = label(options)
    said = {} if options.scene_config is None else _read_yaml(options.scene_config)
    for name in ("fps", "unit_scale", "room", "frame_range"):
        value = getattr(options, name)
        if value not in (None, ""):
            said[name] = value
    if options.bounds:
        said["bounds_m"] = [list(options.bounds[:3]), list(options.bounds[3:])]
    for name in ("drop", "people", "vehicles", "moving"):
        more = list(getattr(options, name))
        if more:
            said[name] = [*_listed(said.get(name, [])), *more]
    given = {"materials": options.material, "object_materials": options.object_material}
    for name in _RULES:
        # The first pattern that fits decides, so options stand first.
        rules = dict(map(_rule, given[name]))
        if rules or name in said:
            rules = {**rules, **_mapping(source, name, said.get(name)), **rules}
            said[name] = [list(rule) for rule in rules.items()]
    if options.ring is not None:
        said["cameras"] = {**_mapping(source, "cameras", said.get("cameras")), "ring": options.ring}
    for name, value in said.items():
        _refuse_strange(f"{source}: {name}", value)
    return said


def label(options: SceneOptions) -> str:
    """Where overrides come from, for messages."""
    return str(options.scene_config or "command line")


@contextmanager
def overrides_file(said: dict[str, Any], label: str = "overrides") -> Iterator[list[str]]:
    """Yields the add-on's arguments that hand over what was said."""
    if not said:
        yield []
        return
    with TemporaryDirectory(prefix="rfgs-") as folder:
        file = Path(folder) / "overrides.json"
        rules = {name: dict(said[name]) for name in _RULES if name in said}
        # Not sorted: of two patterns that fit a name, the first decides.
        file.write_text(json.dumps({**said, **rules, "label": label}, allow_nan=False), "utf-8")
        yield ["--overrides", str(file)]


def _refuse_strange(label: str, value: Any) -> None:
    """Refuses what JSON cannot hand over: dates, sets, bytes, numbers without end."""
    if isinstance(value, list):
        for item in value:
            _refuse_strange(label, item)
    elif isinstance(value, dict):
        for key, item in value.items():
            _refuse_strange(f"{label}: {key}", item)
    elif value is None or isinstance(value, (str, bool)):
        return
    elif not isinstance(value, (int, float)) or not abs(value) < math.inf or abs(value) > 1e300:
        raise RfgsFormatError(f"{label}: expected text or a finite number, got {value!r:.60}")


def _rule(text: str) -> tuple[str, str]:
    name, equals, value = text.rpartition("=")
    if not equals or not name or not value:
        raise RfgsError(f"--material {text!r}: expected NAME=MATERIAL, as in 'Wall*=concrete'")
    return name, value


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _mapping(source: str, name: str, value: Any) -> dict[str, Any]:
    if value is None:
        return {}
    if isinstance(value, int) and name == "cameras":
        return {"ring": value}
    if not isinstance(value, dict):
        raise RfgsError(f"{source}: {name}: expected keys and values, got {value!r:.60}")
    return value


def _read_yaml(path: Path) -> dict[str, Any]:
    values = read_yaml(path)
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise RfgsFormatError(f"{path}: expected `key: value` lines, got {values!r:.60}")
    return values
