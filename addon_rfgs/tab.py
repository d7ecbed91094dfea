# SPDX-License-Identifier: GPL-3.0-or-later
"""The RF-GS tab of the 3D view's sidebar, where every panel stands."""

import textwrap

import bpy

#: Width of a letter of the interface's font at scale 1 [px].
_LETTER_PX = 7
#: Share of a row that names take, and values the rest.
_NAMES = 0.4


class Tab:
    """Mixed into each panel."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RF-GS"

    @staticmethod
    def automatic(
        layout: bpy.types.UILayout, settings: object, name: str, text: str, number: float = 0
    ) -> None:
        """Shows a setting of which one number is none: what that stands for is written below."""
        column = layout.column(align=True)
        column.prop(settings, name)
        if getattr(settings, name) == number:
            row = column.split(factor=_NAMES)
            row.active, row.scale_y = False, 0.8
            row.label(text="")
            row.label(text=text)

    def columns(self, below: bpy.types.UILayout | None = None) -> bpy.types.UILayout:
        """The layout, or the one `below` a step's header, with names beside values."""
        layout = self.layout if below is None else below
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout


def paragraph(layout: bpy.types.UILayout, text: str, icon: str) -> None:
    """Writes words in as many lines as the sidebar needs: labels do not break.

    Args:
        layout: Where to.
        text: The words.
        icon: Stands before the first line.
    """
    context = bpy.context
    scale = context.preferences.system.ui_scale
    letters = max(20, int(context.region.width / (_LETTER_PX * scale)) - 4)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, letters)):
        column.label(text=line, icon="BLANK1" if number else icon)
