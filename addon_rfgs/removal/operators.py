# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that leaves a file as if this add-on had never been there."""

import bpy

from ..command import Command
from ..reporting import Progress, Undoable
from .contents import remove_data


class RFGS_OT_remove_data(Undoable, bpy.types.Operator):
    """Remove devices, Gaussians, ray paths, coverage and every RF-GS setting from this file."""

    bl_label = "Remove RF-GS Data from File"
    command = Command("remove-data", saves=True)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks first."""
        return context.window_manager.invoke_confirm(self, event)

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes everything."""
        objects, properties = remove_data()
        return f"Removed {objects} objects, and RF-GS settings of {properties} data-blocks"
