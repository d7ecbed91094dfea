# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `materials`: list, guess, apply, color."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..errors import AddonError
from ..files import write_json
from ..saving import save_copy
from ..scene.bands import out_of_band, suitable, used_bands, validity
from ..tables import MATERIALS
from . import coloring
from .guesses import assign, guesses, materials_in_use, named_material, settable


def add_materials(commands: Any) -> None:
    """Adds `materials` to the commands."""
    group = commands.add_parser(
        "materials",
        help="list, guess and set radio materials",
        description="Radio materials are models of ITU-R P.2040 and of skin.",
    )
    tasks = group.add_subparsers(dest="task", required=True, metavar="TASK")
    listing = tasks.add_parser("list", help="print materials, what they are and their band")
    listing.add_argument("--json", type=Path, metavar="FILE", help="also write them as JSON")
    listing.set_defaults(run=_list)
    guess = tasks.add_parser("guess", help="print what unlabelled materials seem to be")
    guess.add_argument("--out", type=Path, help=".blend to save with all guesses applied")
    guess.set_defaults(run=_guess)
    apply = tasks.add_parser("apply", help="say what materials are")
    apply.add_argument(
        "radio_material",
        choices=tuple(MATERIALS),
        metavar="RADIO_MATERIAL",
        help=f"one of {', '.join(MATERIALS)}",
    )
    apply.add_argument("material", nargs="+", help="name of a material in the file")
    apply.add_argument("--thickness-m", type=float, metavar="M", help="0: the material's own")
    apply.add_argument("--scattering", type=float, metavar="S", help="0 to 1")
    apply.add_argument("--carrier-ghz", type=float, metavar="GHZ", help="refuse if not valid there")
    apply.set_defaults(run=_apply)
    color = tasks.add_parser("color", help="colour the viewport by radio material, or put it back")
    color.add_argument("--restore", action="store_true", help="put the materials' own colours back")
    color.set_defaults(run=_color)
    for task in (apply, color):
        task.add_argument("--out", type=Path, required=True, help=".blend to save")


def _list(options: argparse.Namespace, _out: TextIO) -> str:
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


def _guess(options: argparse.Namespace, _out: TextIO) -> str:
    found = guesses(bpy.context.scene)
    lines = [f"{row.material}  {row.radio_material}  {row.why}" for row in found]
    if options.out:
        own = settable(found)
        for row in own:
            assign([named_material(row.material)], row.radio_material)
        save_copy(options.out)
        lines.append(f"set {len(own)} materials; wrote {options.out}")
    return "\n".join(lines) or "every material in use is labelled"


def _apply(options: argparse.Namespace, _out: TextIO) -> str:
    if options.thickness_m is not None and not 0 <= options.thickness_m <= 10:
        raise AddonError(f"thickness-m: expected 0 to 10, got {options.thickness_m:g}")
    if options.scattering is not None and not 0 <= options.scattering <= 1:
        raise AddonError(f"scattering: expected 0 to 1, got {options.scattering:g}")
    if options.carrier_ghz is not None:
        bpy.context.scene.rfgs.materials.carrier_ghz = options.carrier_ghz
    bands = used_bands(bpy.context.scene)
    wrong = out_of_band(options.radio_material, bands)
    if wrong:
        raise AddonError(
            f"{options.radio_material} is known from {validity(options.radio_material)} only, not "
            f"at {wrong[0].text} of {wrong[0].label}; choose one of {', '.join(suitable(bands))}"
        )
    chosen = [named_material(name) for name in options.material]
    count = assign(chosen, options.radio_material, options.thickness_m, options.scattering)
    save_copy(options.out)
    return f"set {count} materials to {options.radio_material}; wrote {options.out}"


def _color(options: argparse.Namespace, _out: TextIO) -> str:
    if options.restore:
        done = f"restored {coloring.restore()} materials"
    else:
        done = f"coloured {coloring.color(materials_in_use(bpy.context.scene))} materials"
    save_copy(options.out)
    return f"{done}; wrote {options.out}"
