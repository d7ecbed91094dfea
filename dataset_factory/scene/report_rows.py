# SPDX-License-Identifier: Apache-2.0
"""What the add-on's scene check says, as pages and terminals read it; it may say more."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from rfgs_core.dataset.rows import Frame, Triple
from rfgs_core.files import read_json
from rfgs_core.records import record
from rfgs_core.seals import read_sealed_json

_REMEDY = "check or export the scene again"


class _Scene(Struct):
    frames: Annotated[list[Frame], Meta(min_length=1)]
    frame_start: int
    frame_end: int
    fps: float
    unit_scale_m: float
    bounds_m: tuple[Triple, Triple] | None


class _Material(Struct):
    name: str
    radio_material: str
    why: str


class _Object(Struct, rename={"class_": "class"}):
    name: str
    class_: str
    moving: bool
    instance: str
    triangles: int
    size_m: Triple
    materials: list[_Material]


class _Camera(Struct):
    name: str
    made_up: bool


class _Instance(Struct):
    name: str
    person: bool
    joints: str


class _Device(Struct):
    name: str
    radio: str
    role: str
    position_m: Triple


class Guess(Struct):
    """A default that was guessed."""

    object: str
    what: str
    value: Any
    why: str = ""


class _Finding(Struct):
    kind: str
    severity: str
    object: str
    message: str
    remedy: str


class _Report(Struct):
    file: str
    scene: _Scene
    objects: list[_Object]
    cameras: list[_Camera]
    lights: str
    instances: list[_Instance]
    devices: list[_Device]
    guesses: list[Guess]
    findings: list[_Finding]


def read_report(path: Path) -> dict[str, Any]:
    """The report of a scene check.

    Raises:
        RfgsError: There is none.
        RfgsFormatError: It is damaged.
    """
    value = read_sealed_json(path, _REMEDY)
    record(path, value, _Report, _REMEDY)
    return value


def read_guesses(path: Path) -> list[dict[str, Any]]:
    """Everything that was guessed of a scene.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: The file is damaged.
    """
    value: list[dict[str, Any]] = record(path, read_json(path), list[dict[str, Any]], _REMEDY)
    record(path, value, list[Guess], _REMEDY)
    return value
