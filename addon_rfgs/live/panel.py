# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of what is followed, below that of Gaussians."""

import bpy

from ..steps import PartOfStep
from ..tab import paragraph
from .following import following, told


class RFGS_PT_live(PartOfStep, bpy.types.Panel):
    """Gaussians while radios send."""

    bl_parent_id = "RFGS_PT_gaussians"
    bl_label = "Live"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the port, the button and what was shown last, or why it ended."""
        layout = self.columns()
        layout.prop(context.scene.rfgs.live, "port")
        if following():
            layout.operator("rfgs.stop_live", icon="PAUSE")
        else:
            layout.operator("rfgs.follow_live", icon="PLAY")
        if told():
            paragraph(layout, told(), icon="INFO")
