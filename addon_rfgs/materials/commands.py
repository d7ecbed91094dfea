# SPDX-License-Identifier: GPL-3.0-or-later
"""What the commands of `materials` do beside the buttons."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import bpy

from ..command import Command
from ..errors import AddonError
from ..files import write_json
from ..saving import save_copy
from ..scene.bands import out_of_band, suitable, used_bands, validity
from ..tables import MATERIALS
from .guesses import assign, guesses, materials_in_use, named_material, settable


def _add_list(parser: Any) -> None:
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write them as JSON")


def _list(options: argparse.Namespace) -> str:
    scene = bpy.context.scene
    bands = used_bands(scene)
    seen = {row.material: row for row in guesses(scene)}
    rows = []
    for material in materials_in_use(scene):
        name, guessed = material.rfgs.radio_material, seen.get(material.name)
        value = guessed.radio_material if guessed else name
        rows.append(
            {
                "name": material.name,
                "radio_material": value,
                "why": guessed.why if guessed else "set in the file",
                "valid": validity(value) if value in MATERIALS else "",
                "out_of_band": [b.text for b in out_of_band(value, bands)]
                if value in MATERIALS
                else [],
            }
        )
    if options.json:
        write_json(options.json, rows)
    return "\n".join(
        f"{row['name']}  {row['radio_material']}  {row['why']}  {row['valid']}"
        + (f"  NOT VALID AT {', '.join(row['out_of_band'])}" if row["out_of_band"] else "")
        for row in rows
    )


LIST = Command(
    "materials list",
    "Print materials, what they are and their band",
    add=_add_list,
    work=_list,
)


def add_guess(parser: Any) -> None:
    """The option of `materials guess` beside its button."""
    parser.add_argument("--out", type=Path, help=".blend to save with all guesses applied")


def guess(options: argparse.Namespace) -> str:
    """Prints guesses; sets them in another file, if one is given."""
    found = guesses(bpy.context.scene)
    lines = [f"{row.material}  {row.radio_material}  {row.why}" for row in found]
    if options.out:
        own = settable(found)
        for row in own:
            assign([named_material(row.material)], row.radio_material)
        save_copy(options.out)
        lines.append(f"set {len(own)} materials; wrote {options.out}")
    return "\n".join(lines) or "every material in use is labelled"


def refuse_out_of_band(values: dict[str, Any]) -> None:
    """Refuses a material that is not known where the scene's radios, or the carrier, are.

    Raises:
        AddonError: It is not.
    """
    name, bands = values["radio_material"], used_bands(bpy.context.scene)
    wrong = out_of_band(name, bands)
    if wrong:
        raise AddonError(
            f"{name} is known from {validity(name)} only, not at {wrong[0].text} of "
            f"{wrong[0].label}; choose one of {', '.join(suitable(bands))}"
        )
