# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of what this file holds of RF-GS."""

import bpy

from ..steps import Step
from ..version import version


class RFGS_PT_file(Step, bpy.types.Panel):
    """What this file holds."""

    bl_label = "This File"
    bl_order = 2
    step, icon, unfolds = "file", "FILE_BLEND", False

    def draw_step(self, _context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows the button."""
        layout.operator("rfgs.remove_data", icon="TRASH")
        layout.label(text=f"RF-GS {version()}")
