# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that writes bundles and ground truth."""

import bpy

from ..tab import Tab


class RFGS_PT_dataset(Tab, bpy.types.Panel):
    """Bundle and ground truth."""

    bl_label = "Bundle and Ground Truth"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        """Shows settings and the two buttons."""
        layout, settings = self.columns(), context.scene.rfgs.export
        for name in ("frames", "overrides", "cameras", "resolution"):
            layout.prop(settings, name)
        layout.separator()
        for name in ("bundle_folder", "spans", "velocities"):
            layout.prop(settings, name)
        layout.operator("rfgs.export_bundle", icon="EXPORT")
        for name in ("pictures_folder", "samples", "passes", "empty"):
            layout.prop(settings, name)
        layout.operator("rfgs.render_groundtruth", icon="RENDER_STILL")
