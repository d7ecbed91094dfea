# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that brings Gaussians back into the scene."""

import bpy

from ..tab import Tab


class RFGS_PT_gaussians(Tab, bpy.types.Panel):
    """Gaussians back into the scene."""

    bl_idname = "RFGS_PT_gaussians"
    bl_label = "Gaussians"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the path, display settings and buttons."""
        layout, settings = self.layout, context.scene.rfgs.gaussians
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "path")
        layout.operator("rfgs.import_gaussians", icon="IMPORT")
        layout.prop(settings, "display_mode")
        layout.prop(settings, "opacity_threshold")
        layout.operator("rfgs.update_display", icon="FILE_REFRESH")
