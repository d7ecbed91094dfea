# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of what this file holds of RF-GS."""

import bpy

from ..tab import Tab
from ..version import version


class RFGS_PT_file(Tab, bpy.types.Panel):
    """What this file holds."""

    bl_label = "This File"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, _context: bpy.types.Context) -> None:
        """Shows the button."""
        self.layout.operator("rfgs.remove_data", icon="TRASH")
        self.layout.label(text=f"RF-GS {version()}")
