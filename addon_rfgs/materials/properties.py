# SPDX-License-Identifier: GPL-3.0-or-later
"""The radio meaning of a material, what it is checked against, and the table of guesses."""

from __future__ import annotations

import zlib

import bpy

from ..scene.bands import validity
from ..tables import MATERIALS
from .coloring import recolor


def _label(name: str) -> str:
    return name.replace("_", " ").capitalize()


def material_items(*, guess: bool) -> list[tuple[str, str, str, int]]:
    """Enum rows whose stored numbers follow from the name, so a longer table shifts nothing.

    Args:
        guess: Whether not to say is a choice too.
    """
    items = [("AUTO", "Guess", "Guess the material from names and shape", 0)] if guess else []
    for name, row in MATERIALS.items():
        text = f"{row['model']}, valid {validity(name)}, {row['thickness_m']:g} m thick"
        items.append((name, _label(name), text, zlib.crc32(name.encode()) & 0x7FFFFFFF))
    return items


def _changed(self: RFGS_PG_material, _context: bpy.types.Context) -> None:
    if self.colored:
        recolor(self.id_data)


class RFGS_PG_material(bpy.types.PropertyGroup):
    """Radio meaning of a material."""

    radio_material: bpy.props.EnumProperty(
        name="Radio material",
        description="Electrical model of this surface",
        items=material_items(guess=True),
        default="AUTO",
        update=_changed,
    )
    thickness_m: bpy.props.FloatProperty(
        name="Thickness [m]",
        description="Thickness of the slab behind this surface [m]; 0 takes the material's own",
        min=0.0,
        soft_max=1.0,
        precision=4,
        step=0.1,
    )
    scattering_coefficient: bpy.props.FloatProperty(
        name="Scattering",
        description="Share of the reflected field's amplitude that is scattered diffusely, 0 to 1",
        min=0.0,
        max=1.0,
    )
    colored: bpy.props.BoolProperty(
        name="Coloured",
        description="Whether the viewport colour shows the radio material for the time being",
        options={"HIDDEN"},
    )
    own_color: bpy.props.FloatVectorProperty(
        name="Own Colour",
        description="Viewport colour to be put back",
        size=4,
        default=(0.0, 0.0, 0.0, 0.0),
        subtype="COLOR",
        options={"HIDDEN"},
    )


class RFGS_PG_guess(bpy.types.PropertyGroup):
    """One material and what its name suggests."""

    material: bpy.props.StringProperty(name="Material", description="Name of the material")
    radio_material: bpy.props.EnumProperty(
        name="Radio material",
        description="What it becomes when the table is applied",
        items=material_items(guess=False),
    )
    why: bpy.props.StringProperty(name="Why", description="What the guess rests on")
    use: bpy.props.BoolProperty(
        name="Apply", description="Set this material when the table is applied", default=True
    )


class RFGS_PG_guesses(bpy.types.PropertyGroup):
    """The table of guesses that waits to be confirmed."""

    rows: bpy.props.CollectionProperty(
        type=RFGS_PG_guess, name="Guesses", description="One row for each unlabelled material"
    )
    active: bpy.props.IntProperty(name="Guess", description="The active row of the table", min=0)


class RFGS_PG_materials(bpy.types.PropertyGroup):
    """What materials are checked against."""

    carrier_ghz: bpy.props.FloatProperty(
        name="Carrier [GHz]",
        description="Frequency at which materials must be known; 0: the bands of the scene's "
        "radio devices",
        min=0.0,
        max=100.0,
        precision=3,
    )
