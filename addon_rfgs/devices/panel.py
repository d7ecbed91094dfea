# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of the active object: what it is to the radio."""

import bpy

from ..tab import Tab


class RFGS_PT_object(Tab, bpy.types.Panel):
    """Radio meaning of the active object."""

    bl_idname = "RFGS_PT_object"
    bl_label = "Radio"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows what applies to the type of the active object."""
        layout, item = self.layout, context.object
        layout.use_property_split = True
        layout.use_property_decorate = False
        if item is None:
            layout.label(text="No active object", icon="INFO")
            return
        if item.type == "EMPTY":
            layout.prop(item.rfgs, "role")
            if item.rfgs.role != "NONE":
                layout.prop(item.rfgs, "radio")
                if item.rfgs.radio in {"any", "scene"}:
                    box = layout.box()
                    box.label(text="Radio 'scene'")
                    for name in item.rfgs.rf.bl_rna.properties.keys()[2:]:
                        box.prop(item.rfgs.rf, name)
        if item.type in {"MESH", "CURVE", "SURFACE", "FONT", "META", "EMPTY"}:
            layout.prop(item.rfgs, "object_class")
            layout.prop(item.rfgs, "instance")
            layout.prop(item.rfgs, "surface_m2")
