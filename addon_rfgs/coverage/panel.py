# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of coverage, below that of Gaussians."""

import bpy

from ..steps import PartOfStep


class RFGS_PT_coverage(PartOfStep, bpy.types.Panel):
    """How loud transmitters are over a plane."""

    bl_parent_id = "RFGS_PT_gaussians"
    bl_label = "Coverage"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows file, transmitter and the two buttons."""
        layout, settings = self.columns(), context.scene.rfgs.coverage
        layout.prop(settings, "path")
        self.automatic(layout, settings, "tx_device", "the loudest one", number=-1)
        layout.operator("rfgs.show_coverage", icon="MESH_GRID")
        layout.operator("rfgs.clear_coverage", icon="TRASH")
