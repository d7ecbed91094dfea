# SPDX-License-Identifier: Apache-2.0
"""Writes the tables the Blender add-on needs, since it must not import this package.

`python -m rfgs_core.sync` rewrites `addon_rfgs/tables.json` from the presets, materials and
skeleton of this package; a test compares the two.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, get_args

from rfgs_core.files import write_text
from rfgs_core.radio.antennas import PATTERNS, POLARIZATIONS
from rfgs_core.radio.check import ROOM_FRACTION
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.files import MOST_ELEMENTS
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.placement import NEARER, NOT_AT_WALL_M, SUNK_M
from rfgs_core.radio.presets import PRESETS, OwnLinks, Radio, preset
from rfgs_core.skeleton import JOINTS, PARENTS

#: Where the add-on keeps its copy.
TABLES_PATH = Path(__file__).resolve().parent.parent / "addon_rfgs" / "tables.json"


#: Fields of a radio that the add-on's Empties hold; the others are about placing devices.
SCENE_FIELDS = (
    *("freq_min_hz", "freq_max_hz", "num_subcarriers"),
    *("tx_rows", "tx_cols", "rx_rows", "rx_cols", "tx_spacing_m", "rx_spacing_m", "tx_offset_m"),
    *("own_device_links", "isolation_db", "power_dbm", "noise_figure_db"),
    *("pattern", "polarization"),
)

#: Fields of a radio that say where its devices stand in a scene that brings none.
PLACEMENT_FIELDS = ("placement", "num_places", "heights_m", "inset_m")


def describe(radio: Radio) -> str:
    """One line about a radio for a tooltip."""
    return (
        f"{radio.freq_min_hz / 1e9:g}–{radio.freq_max_hz / 1e9:g} GHz, "
        f"{radio.num_subcarriers} subcarriers, "
        f"{radio.tx_rows * radio.tx_cols} TX and {radio.rx_rows * radio.rx_cols} RX elements"
    )


def tables() -> dict[str, Any]:
    """Everything the add-on shares with this package, as plain JSON values."""
    return {
        "schema": "rfgs-tables/1",
        "speed_of_light": SPEED_OF_LIGHT,
        "room_fraction": ROOM_FRACTION,
        "nearer": list(NEARER),
        "not_at_wall_m": NOT_AT_WALL_M,
        "sunk_m": SUNK_M,
        "most_elements": MOST_ELEMENTS,
        "radios": [
            {
                "name": radio.name,
                "description": describe(radio),
                "fields": {name: getattr(radio, name) for name in SCENE_FIELDS},
                "placement": {name: getattr(radio, name) for name in PLACEMENT_FIELDS},
            }
            for radio in PRESETS.values()
        ],
        "radio_defaults": {name: getattr(preset("wifi"), name) for name in SCENE_FIELDS},
        "radio_choices": {
            "pattern": list(PATTERNS),
            "polarization": list(POLARIZATIONS),
            "own_device_links": list(get_args(OwnLinks)),
        },
        "materials": [
            {
                "name": material.name,
                "model": material.model,
                "freq_min_hz": material.freq_min_hz,
                "freq_max_hz": material.freq_max_hz,
                "thickness_m": material.thickness_m,
                "color": list(material.colour),
            }
            for material in MATERIALS.values()
        ],
        "joints": list(JOINTS),
        "parents": list(PARENTS),
    }


def text() -> str:
    """The exact text of the add-on's table file."""
    return json.dumps(tables(), indent=1, ensure_ascii=False) + "\n"


def main() -> None:
    """Writes the table file."""
    write_text(TABLES_PATH, text())
    sys.stdout.write(f"wrote {TABLES_PATH}\n")


if __name__ == "__main__":
    main()
