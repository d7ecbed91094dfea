# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of radio materials: the active one, and the table of guesses."""

from __future__ import annotations

from typing import Any

import bpy

from ..scene.bands import out_of_band, used_bands, validity
from ..steps import PartOfStep
from ..tab import Tab
from ..tables import MATERIALS
from .coloring import colored
from .properties import RFGS_PG_guess


class RFGS_PT_material(PartOfStep, bpy.types.Panel):
    """Radio meaning of the active object's material."""

    bl_label = "Radio Materials"
    bl_parent_id = "RFGS_PT_check"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the carrier, the electrical model and what replaces its defaults."""
        layout = self.columns()
        settings = context.scene.rfgs.materials
        bands = used_bands(context.scene)
        text = ", ".join(band.text for band in bands) or "as generated"
        self.automatic(layout, settings, "carrier_ghz", text)
        material = context.object.active_material if context.object else None
        if material is not None:
            box = layout.box()
            box.label(text=material.name, icon="MATERIAL")
            box.prop(material.rfgs, "radio_material")
            name = material.rfgs.radio_material
            if name in MATERIALS:
                wrong = out_of_band(name, bands)
                row = box.row()
                row.alert = bool(wrong)
                text = f"not at {wrong[0].text}: " if wrong else ""
                row.label(text=f"{text}valid {validity(name)}", icon="ERROR" if wrong else "BLANK1")
            own = f"{MATERIALS[name]['thickness_m']:g} m" if name in MATERIALS else "its own"
            self.automatic(box, material.rfgs, "thickness_m", own)
            box.prop(material.rfgs, "scattering_coefficient")
        assign = layout.operator_menu_enum(
            "rfgs.assign_material", "radio_material", text="Set All of Selected Objects"
        )
        assign.to = "SELECTED"
        layout.operator(
            "rfgs.color_materials",
            text="Put Colours Back" if colored() else "Colour by Radio Material",
            icon="COLOR",
            depress=bool(colored()),
        )
        shading = context.space_data.shading
        if colored() and shading.type == "SOLID" and shading.color_type != "MATERIAL":
            layout.prop(shading, "color_type", text="View Shows")


class RFGS_UL_guesses(bpy.types.UIList):
    """Materials and what their names suggest."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: Any,
        item: RFGS_PG_guess,
        _icon: int,
        _active_data: Any,
        _active_property: str,
    ) -> None:
        """One material: whether to set it, its name, what it becomes."""
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        row.label(text=item.material)
        row.prop(item, "radio_material", text="", emboss=False)


class RFGS_PT_guesses(Tab, bpy.types.Panel):
    """What materials seem to be."""

    bl_label = "Guesses"
    bl_parent_id = "RFGS_PT_material"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the table, why the active row is as it is, and the buttons around it."""
        layout, table = self.layout, context.window_manager.rfgs.guesses
        layout.operator("rfgs.guess_materials", icon="VIEWZOOM")
        if not table.rows:
            return
        layout.template_list("RFGS_UL_guesses", "", table, "rows", table, "active", rows=5)
        if table.active < len(table.rows):
            layout.label(text=table.rows[table.active].why, icon="INFO")
        layout.operator("rfgs.apply_guesses", icon="CHECKMARK")
