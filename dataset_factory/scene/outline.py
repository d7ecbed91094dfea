# SPDX-License-Identifier: Apache-2.0
"""What a Blender file says of itself at once: its frames, and devices that nobody asked for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dataset_factory.scene.blender import Blender
from dataset_factory.scene.overrides import overrides_file
from dataset_factory.scene.radios import SCENE_RADIO
from rfgs_core.radio import PRESETS, Radio
from rfgs_core.records import record
from rfgs_core.seals import read_sealed_json

#: Radio of devices that take part in any.
ANY_RADIO = "any"


@dataclass(frozen=True)
class Outline:
    """Frames and devices of a file, and what time and disk go by."""

    frames: list[int]
    """Frames that were asked for."""
    devices: list[dict[str, Any]]
    """Name, radio and role of each device."""
    cameras: int
    """Cameras that it would be rendered with."""
    aspect: float
    """Shorter by longer side of a picture."""
    people: int
    """How many people there seem to be."""
    fps: float
    """Frames per second."""


def read_outline(
    blender: Blender, frames: str, said: dict[str, Any], label: str, *, between: bool
) -> Outline:
    """Looks into a file without surveying it, which takes as long as its frames.

    Args:
        blender: The Blender file.
        frames: `A:B[:STEP]`, empty for the scene's own range.
        said: Overrides, in the words of the YAML file.
        label: Where they come from, for messages.
        between: Whether packets between frames are wanted, which the last frame has none of.

    Raises:
        RfgsError: The file cannot be opened, has no such frames, or the overrides make no sense.
    """
    asked = [*(["--frames", frames] if frames else []), *(["--between"] if between else [])]
    with TemporaryDirectory(prefix="rfgs-") as name, overrides_file(said, label) as more:
        file = Path(name) / "outline.json"
        blender.run("outline", "--out", str(file), *asked, *more)
        return read_outline_file(file)


def read_outline_file(file: Path) -> Outline:
    """What Blender wrote of a file.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged.
    """
    found: Outline = record(file, read_sealed_json(file, "read the scene again"), Outline)
    return found


def usual_radios(devices: Iterable[dict[str, Any]]) -> tuple[str, ...]:
    """Radios that are meant where nobody names one: that of somebody's own devices, else none."""
    own = any(row["role"] != "NONE" and row["radio"] == SCENE_RADIO for row in devices)
    return (SCENE_RADIO,) if own else ()


def no_radio(devices: Iterable[dict[str, Any]]) -> str:
    """Why a radio must be named for a scene without devices of somebody's own, and which."""
    named = {row["radio"] for row in devices if row["role"] != "NONE"} - {ANY_RADIO}
    if named:
        several = "s" * (len(named) > 1)
        return (
            f"no radio given, and the scene has devices of the radio{several} "
            f"{', '.join(map(repr, sorted(named)))}; add "
            + " or ".join(
                f"--radio {name if name in PRESETS else 'a file that describes it'}"
                for name in sorted(named)
            )
        )
    return (
        "no radio given, and the scene has no devices of its own; add --radio wifi, "
        "--radio mmwave or both"
    )


def device_radios(radio: Radio) -> set[str]:
    """Radios of the devices that take part in one.

    A device for any radio is a place for a box in a corner, not for an array along a wall: such
    radios take only devices with their own name.
    """
    at_points = radio.placement == "corners" or radio.name == SCENE_RADIO
    return {ANY_RADIO, radio.name} if at_points else {radio.name}


def silence(devices: Iterable[dict[str, Any]], radio: Radio) -> str:
    """Why the devices of a scene make no channel of a radio, with the remedy; empty if they do."""
    names = device_radios(radio)
    own = [row for row in devices if row["role"] != "NONE" and row["radio"] in names]
    for other, word, role in (
        ("RECEIVER", "transmits", "transmitter"),
        ("TRANSMITTER", "receives", "receiver"),
    ):
        if own and all(row["role"] == other for row in own):
            return (
                f"no device of radio {radio.name!r} {word}; give an Empty the role {role} or "
                "access point"
            )
    return ""


def left_out(devices: Iterable[dict[str, Any]], radios: Iterable[Radio]) -> list[str]:
    """Says which devices of a scene take part in none of some radios, and what would change that.

    Args:
        devices: Name, radio and role of each.
        radios: Radios that are to be traced.

    Returns:
        One sentence for each radio whose devices are left out.
    """
    radios = list(radios)
    taken = set().union(*(device_radios(radio) for radio in radios))
    missing: dict[str, list[str]] = {}
    for row in devices:
        if row["role"] != "NONE" and row["radio"] not in taken:
            missing.setdefault(row["radio"], []).append(row["name"])
    asked = ", ".join(radio.name for radio in radios)
    said = []
    for radio, names in missing.items():
        many = len(names) > 1
        who = f"device{'s' * many} {', '.join(map(repr, names))} of radio {radio!r}"
        file = "a file that describes it"
        remedy = f"add --radio {radio if radio in (*PRESETS, SCENE_RADIO) else file}"
        if radio == ANY_RADIO:
            remedy = f"{asked} takes devices of its own name only"
        said.append(f"{who} {'are' if many else 'is'} left out of {asked}; {remedy}")
    return said
