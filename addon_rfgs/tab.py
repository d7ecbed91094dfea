# SPDX-License-Identifier: GPL-3.0-or-later
"""The RF-GS tab of the 3D view's sidebar, where every panel stands."""

import bpy


class Tab:
    """Mixed into each panel."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RF-GS"

    @staticmethod
    def automatic(layout: bpy.types.UILayout, settings: object, name: str, text: str) -> None:
        """Shows a number whose zero is no number: what it stands for is written beside it."""
        row = layout.row()
        row.prop(settings, name)
        if not getattr(settings, name):
            row.label(text=text)

    def columns(self) -> bpy.types.UILayout:
        """The layout, with names beside values."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout
