# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that say what materials are to the radio."""

from __future__ import annotations

import bpy

from ..command import Command
from ..errors import AddonError
from ..reporting import Progress, Reporting, Undoable
from . import coloring, commands
from .guesses import assign, guesses, materials_in_use, named_material, settable
from .properties import material_items


class RFGS_OT_assign_material(Undoable, bpy.types.Operator):
    """Make materials a building material of ITU-R P.2040, or skin, with its own thickness."""

    bl_label = "Assign Radio Material"
    command = Command(
        "materials apply",
        reads={"materials": ("carrier_ghz",)},
        words={"radio_material": "radio_material", "materials": "material"},
        means={"material": {"to": "NAMED"}},
        prepare=commands.refuse_out_of_band,
        saves=True,
    )

    radio_material: bpy.props.EnumProperty(
        name="Radio Material", description="Electrical model", items=material_items(guess=False)
    )
    to: bpy.props.EnumProperty(
        name="To",
        description="Which materials are set",
        items=[
            ("ACTIVE", "Active Material", "The active material of the active object"),
            ("SELECTED", "Selected Objects", "All materials of the selected objects"),
            ("NAMED", "Named", "Those that are named"),
        ],
    )
    materials: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement,
        name="Materials",
        description="Names of materials in the file",
        options={"SKIP_SAVE"},
    )
    thickness_m: bpy.props.FloatProperty(
        name="Thickness",
        description="Of the slab behind the surface [m]; 0 takes the material's own",
        min=0.0,
        max=10.0,
        soft_max=1.0,
        precision=4,
    )
    scattering: bpy.props.FloatProperty(
        name="Scattering",
        description="Share of the reflected field's amplitude that is scattered diffusely",
        min=0.0,
        max=1.0,
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Sets the materials."""
        if self.to == "NAMED":
            chosen = [named_material(row.name) for row in self.materials]
        else:
            chosen = _targets(context, self.to)
        # A command that is not told of the two leaves them as they are.
        told = [
            getattr(self, name)
            if self.to != "NAMED" or self.properties.is_property_set(name)
            else None
            for name in ("thickness_m", "scattering")
        ]
        count = assign(chosen, self.radio_material, *told)
        return f"Set {count} materials to {self.radio_material}"


class RFGS_OT_guess_materials(Reporting, bpy.types.Operator):
    """List what the names and shapes of unlabelled materials suggest, to be confirmed."""

    bl_label = "Guess from Names"
    command = Command("materials guess", add=commands.add_guess, work=commands.guess)

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Fills the table."""
        table = context.window_manager.rfgs.guesses
        every = guesses(context.scene)
        found = settable(every)
        table.rows.clear()
        table.active = 0
        for row in found:
            item = table.rows.add()
            item.material, item.radio_material = row.material, row.radio_material
            item.why = row.why
        if every and not found:
            return f"{len(every)} materials are linked; label them in their own files"
        return f"{len(found)} guesses to confirm" if found else "Every material in use is labelled"


class RFGS_OT_apply_guesses(Undoable, bpy.types.Operator):
    """Set the materials that are ticked in the table, and clear it."""

    bl_label = "Apply Guesses"

    @classmethod
    def ready(cls, context: bpy.types.Context) -> bool:
        """There is a table."""
        there = len(context.window_manager.rfgs.guesses.rows) > 0
        if not there:
            cls.poll_message_set("Press Guess from Names first")
        return there

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Applies the table."""
        table = context.window_manager.rfgs.guesses
        chosen = [
            (named_material(row.material), row.radio_material) for row in table.rows if row.use
        ]
        count = sum(assign([material], value) for material, value in chosen)
        table.rows.clear()
        return f"Set {count} materials"


class RFGS_OT_color_materials(Undoable, bpy.types.Operator):
    """Colour materials in the viewport by what they are to the radio, or put their own back.

    Seen in solid view with the colour Material; grey is what would be guessed
    """

    bl_label = "Colour by Radio Material"
    command = Command(
        "materials color",
        unsaid={"action": "COLOR"},
        means={"--restore": {"action": "RESTORE"}},
        saves=True,
    )

    action: bpy.props.EnumProperty(
        name="Action",
        description="What to do",
        items=[
            ("TOGGLE", "Toggle", "Colour, or put back if coloured"),
            ("COLOR", "Colour", "Colour every material in use"),
            ("RESTORE", "Restore", "Put the materials' own colours back"),
        ],
        options={"SKIP_SAVE"},
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Colours or restores."""
        restore = self.action == "RESTORE" or (self.action == "TOGGLE" and coloring.colored())
        if restore:
            return f"Restored {coloring.restore()} materials"
        return f"Coloured {coloring.color(materials_in_use(context.scene))} materials"


def _targets(context: bpy.types.Context, to: str) -> list[bpy.types.Material]:
    """Materials that are meant.

    Raises:
        AddonError: There is none, or one is linked from another file.
    """
    items = context.selected_objects if to == "SELECTED" else [context.object]
    found = {
        slot.material.name
        for item in items
        if item is not None
        for slot in item.material_slots
        if slot.material and (to == "SELECTED" or slot.material == item.active_material)
    }
    if not found:
        where = "selected objects have" if to == "SELECTED" else "active object has"
        raise AddonError(f"the {where} no material; add one in the material properties")
    return [named_material(name) for name in sorted(found)]
