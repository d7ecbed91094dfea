# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of ray paths."""

import bpy

from ..steps import PartOfStep


class RFGS_PT_paths(PartOfStep, bpy.types.Panel):
    """Ray paths as curves."""

    bl_label = "Ray Paths"
    bl_parent_id = "RFGS_PT_gaussians"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows settings and the two buttons."""
        layout, settings = self.columns(), context.scene.rfgs.paths
        for name in type(settings).bl_rna.properties.keys():
            if name not in {"rna_type", "name"}:
                row = layout.row()
                row.active = name != "follow" or not settings.static
                if name in {"tx_device", "rx_device"}:
                    self.automatic(row, settings, name, "all of them", number=-1)
                else:
                    row.prop(settings, name)
        layout.operator("rfgs.show_paths", icon="CURVE_PATH")
        layout.operator("rfgs.clear_paths", icon="TRASH")
