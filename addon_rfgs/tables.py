# SPDX-License-Identifier: GPL-3.0-or-later
"""Radios, materials and joints shared with the rest of RF-GS; `make sync` writes the file."""

from __future__ import annotations

import json
from pathlib import Path

_TABLES = json.loads((Path(__file__).parent / "tables.json").read_text("utf-8"))

#: Name and one-line description of every radio preset.
RADIOS: dict[str, str] = {row["name"]: row["description"] for row in _TABLES["radios"]}

#: What Empties hold of a radio, for every preset.
RADIO_FIELDS: dict[str, dict] = {row["name"]: row["fields"] for row in _TABLES["radios"]}

#: Of every preset: placement (the rule), num_places, heights_m [m] and inset_m [m].
RADIO_PLACEMENTS: dict[str, dict] = {row["name"]: row["placement"] for row in _TABLES["radios"]}

#: In vacuum [m/s].
SPEED_OF_LIGHT: float = _TABLES["speed_of_light"]

#: A closed mesh that fills more of the scene than this is the room itself, not furniture.
ROOM_FRACTION: float = _TABLES["room_fraction"]

#: A device in a corner that is outside the room comes nearer to the people by such a share.
NEARER: tuple[float, ...] = tuple(_TABLES["nearer"])

#: It keeps this far from what it came around [m].
NOT_AT_WALL_M: float = _TABLES["not_at_wall_m"]

#: Bounds that reach this far below the floor under the people hold something that fell [m].
SUNK_M: float = _TABLES["sunk_m"]

#: An array with more elements is refused by the factory.
MOST_ELEMENTS: int = _TABLES["most_elements"]

#: Fields of a radio that Empties hold, with the value each starts with.
RADIO_DEFAULTS: dict[str, object] = _TABLES["radio_defaults"]

#: What pattern, polarization and own_device_links may be.
RADIO_CHOICES: dict[str, list[str]] = _TABLES["radio_choices"]

#: Radio materials by name, each with model, freq_min_hz, freq_max_hz, thickness_m [m] and color.
MATERIALS: dict[str, dict] = {row["name"]: row for row in _TABLES["materials"]}

#: Names of the 17 joints, in the order of every joint array.
JOINTS: tuple[str, ...] = tuple(_TABLES["joints"])

#: Index of each joint's parent, -1 for the root.
PARENTS: tuple[int, ...] = tuple(_TABLES["parents"])
