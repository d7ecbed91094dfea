# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons around imported Gaussians."""

import bpy

from ..errors import AddonError
from ..reporting import Progress, Reporting, chosen_path
from .clouds import COLLECTION, Display, import_gaussians
from .nodes import GROUP, set_display


class RFGS_OT_import_gaussians(Reporting, bpy.types.Operator):
    """Bring the Gaussians of a run, or of one PLY, into the scene."""

    bl_idname = "rfgs.import_gaussians"
    bl_label = "Import Gaussians"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports with the panel's settings."""
        settings = context.scene.rfgs.gaussians
        display = Display(settings.display_mode, settings.opacity_threshold)
        done = import_gaussians(context.scene, chosen_path(settings.path), display)
        return f"Imported {done.count} Gaussians in {len(done.objects)} clouds"


class RFGS_OT_update_display(Reporting, bpy.types.Operator):
    """Apply mode and opacity threshold to Gaussians that are already here."""

    bl_idname = "rfgs.update_display"
    bl_label = "Update Display"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Writes the panel's settings into every modifier."""
        collection = bpy.data.collections.get(COLLECTION)
        items = (
            [item for item in collection.objects if GROUP in item.modifiers] if collection else []
        )
        if not items:
            raise AddonError("no imported Gaussians in this file")
        settings = context.scene.rfgs.gaussians
        for item in items:
            set_display(item, settings.display_mode, settings.opacity_threshold)
        return f"Updated {len(items)} clouds"
