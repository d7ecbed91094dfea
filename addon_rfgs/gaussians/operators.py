# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that bring Gaussians in, write them out and compare them."""

import bpy

from ..reporting import Progress, Reporting, chosen_path
from .clouds import import_gaussians


class RFGS_OT_import_gaussians(Reporting, bpy.types.Operator):
    """Bring the Gaussians of a run, or of one PLY, into the scene."""

    bl_idname = "rfgs.import_gaussians"
    bl_label = "Import Gaussians"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports with the panel's settings."""
        settings = context.scene.rfgs.gaussians
        done = import_gaussians(context.scene, chosen_path(settings.path), settings.inspection())
        return f"Imported {done.count} Gaussians in {len(done.objects)} clouds"
