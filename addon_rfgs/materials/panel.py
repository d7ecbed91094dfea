# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of the active material."""

import bpy

from ..tab import Tab
from ..tables import MATERIALS


class RFGS_PT_material(Tab, bpy.types.Panel):
    """Radio meaning of the active object's material."""

    bl_idname = "RFGS_PT_material"
    bl_label = "Radio Material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a material to speak of."""
        return context.object is not None and context.object.active_material is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the electrical model and what replaces its defaults."""
        layout, material = self.layout, context.object.active_material
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text=material.name, icon="MATERIAL")
        layout.prop(material.rfgs, "radio_material")
        layout.prop(material.rfgs, "thickness_m")
        if material.rfgs.thickness_m == 0 and material.rfgs.radio_material in MATERIALS:
            thickness_m = MATERIALS[material.rfgs.radio_material]["thickness_m"]
            layout.label(text=f"{thickness_m:g} m, the material's own")
        layout.prop(material.rfgs, "scattering_coefficient")
