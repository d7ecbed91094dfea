# SPDX-License-Identifier: Apache-2.0
"""Writes the tables the Blender add-on needs, since it must not import this package.

`python -m rfgs_core.sync` rewrites `addon_rfgs/tables.json` from the presets, materials and
skeleton of this package; a test compares the two.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from rfgs_core.files import write_text
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.presets import PRESETS, Radio
from rfgs_core.skeleton import JOINTS, PARENTS

#: Where the add-on keeps its copy.
TABLES_PATH = Path(__file__).resolve().parent.parent / "addon_rfgs" / "tables.json"


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
        "radios": [
            {"name": radio.name, "description": describe(radio)} for radio in PRESETS.values()
        ],
        "materials": [
            {
                "name": material.name,
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
