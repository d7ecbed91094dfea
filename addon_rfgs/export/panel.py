# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that writes bundles and ground truth."""

import bpy

from ..steps import PartOfStep


class RFGS_PT_dataset(PartOfStep, bpy.types.Panel):
    """Bundle and ground truth."""

    bl_label = "Bundle and Ground Truth"
    bl_parent_id = "RFGS_PT_generate"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows settings and the two buttons."""
        layout, settings = self.columns(), context.scene.rfgs.export
        layout.prop(settings, "frames", placeholder="all")
        layout.prop(settings, "overrides", placeholder="none")
        self.automatic(layout, settings, "cameras", "all")
        self.automatic(layout, settings, "resolution", "from the file")
        layout.separator()
        layout.prop(settings, "bundle_folder")
        layout.prop(settings, "spans", placeholder="none")
        layout.prop(settings, "velocities")
        layout.operator("rfgs.export_bundle", icon="EXPORT")
        for name in ("pictures_folder", "samples", "passes", "empty"):
            layout.prop(settings, name)
        layout.operator("rfgs.render_groundtruth", icon="RENDER_STILL")
