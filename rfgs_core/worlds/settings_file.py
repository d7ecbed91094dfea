# SPDX-License-Identifier: Apache-2.0
"""The file that says what all random worlds of a folder have in common."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec

from rfgs_core.radio import Radio
from rfgs_core.radio.files import checked_radio, radio_values
from rfgs_core.records import read_record
from rfgs_core.worlds.world import WorldSettings

#: Its name in the folder.
SETTINGS_FILE = "worlds.json"


@dataclass(frozen=True)
class Pictures:
    """How worlds are rendered."""

    cameras: int
    """Cameras of each."""
    resolution_px: int
    """Longer side of a picture [px]."""
    samples: int
    """Light samples per pixel."""


@dataclass(frozen=True)
class WorldsFile:
    """What worlds of one folder have in common."""

    radio: Radio
    """The radio, before each world draws its number of devices."""
    settings: WorldSettings
    """The rest of it."""
    seed: int
    """Root seed."""
    pictures: Pictures | None = None
    """How they are rendered; None where they are not."""
    tracer: Literal["fast", "sionna"] = "fast"
    """What traces the channels."""

    @property
    def in_blender(self) -> bool:
        """Whether a scene of Blender is made of each world."""
        return self.pictures is not None or self.tracer != "fast"

    def as_json(self) -> dict[str, Any]:
        """The same in JSON's types."""
        values = {**asdict(self), "radio": radio_values(self.radio)}
        # As a file gives it back: tuples are lists there.
        read: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(values))
        return read


class _Values(msgspec.Struct):
    """The file as it is written."""

    radio: dict[str, Any]
    settings: WorldSettings
    seed: int
    pictures: Pictures | None = None
    tracer: Literal["fast", "sionna"] = "fast"


def read_worlds_file(path: Path) -> WorldsFile:
    """Reads what worlds have in common.

    Raises:
        RfgsError: There is no such file, it is damaged, or no world can have such settings.
    """
    values = read_record(path, _Values, "made by `rfgs-factory worlds`")
    radio = checked_radio(f"{path}: radio", values.radio)
    values.settings.check()
    return WorldsFile(radio, values.settings, values.seed, values.pictures, values.tracer)
