# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of channels, below that of Gaussians."""

import bpy

from ..steps import PartOfStep


class RFGS_PT_channels(PartOfStep, bpy.types.Panel):
    """Measured and predicted channels of a link."""

    bl_parent_id = "RFGS_PT_gaussians"
    bl_label = "Channels"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the link and the button."""
        layout, settings = self.columns(), context.scene.rfgs.channels
        layout.prop(settings, "run_folder", placeholder="the one imported")
        layout.prop(settings, "tx_device")
        self.automatic(layout, settings, "rx_device", "the first to hear", number=-1)
        layout.operator("rfgs.show_csi", icon="IMAGE_DATA")
