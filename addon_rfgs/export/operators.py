# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that write what the commands `export` and `groundtruth` write."""

import bpy

from ..reporting import Progress, Reporting, chosen_path
from .bundle import export_bundle
from .groundtruth import render_groundtruth


class RFGS_OT_export_bundle(Reporting, bpy.types.Operator):
    """Write the scene as a bundle for the dataset factory."""

    bl_idname = "rfgs.export_bundle"
    bl_label = "Export Bundle"

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Exports with the panel's settings."""
        settings = context.scene.rfgs.export
        folder = chosen_path(settings.bundle_folder)
        info = export_bundle(
            context.scene,
            folder,
            settings.frames or None,
            settings.cameras or None,
            settings.resolution or None,
            progress,
        )
        return f"Wrote {len(info['frames'])} frames to {folder}"


class RFGS_OT_render_groundtruth(Reporting, bpy.types.Operator):
    """Render pictures, and passes if wanted, from every camera with Cycles."""

    bl_idname = "rfgs.render_groundtruth"
    bl_label = "Render Ground Truth"

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Renders with the panel's settings."""
        settings = context.scene.rfgs.export
        folder = chosen_path(settings.pictures_folder)
        count = render_groundtruth(
            context.scene,
            folder,
            settings.frames or None,
            settings.cameras or None,
            settings.resolution or None,
            settings.samples,
            settings.passes,
            progress=progress,
        )
        return f"Wrote {count} pictures to {folder}"
