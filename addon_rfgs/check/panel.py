# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of the scene check."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from ..tab import Tab
from .settings import RFGS_PG_finding

_ICONS = {"ERROR": "CANCEL", "WARNING": "ERROR", "INFO": "INFO"}
#: Width of a letter of the interface's font at scale 1 [px].
_LETTER_PX = 7


class RFGS_UL_findings(bpy.types.UIList):
    """What the scene check found."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: Any,
        item: RFGS_PG_finding,
        _icon: int,
        _active_data: Any,
        _active_property: str,
    ) -> None:
        """One finding: how bad, about what, and what."""
        row = layout.row(align=True)
        row.label(text=item.object, icon=_ICONS[item.severity])
        row.label(text=item.message)


class RFGS_PT_check(Tab, bpy.types.Panel):
    """What would go wrong."""

    bl_label = "2 Check"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the button, the list, and the active finding in full."""
        layout, check = self.layout, context.window_manager.rfgs.check
        layout.operator("rfgs.check_scene", icon="VIEWZOOM")
        if check.outdated:
            layout.label(text="Out of date: check again", icon="ERROR")
        elif check.summary:
            layout.label(text=check.summary)
        if not check.rows:
            return
        layout = layout.column()
        layout.active = not check.outdated
        layout.template_list("RFGS_UL_findings", "", check, "rows", check, "active", rows=5)
        if check.active >= len(check.rows):
            return
        item = check.rows[check.active]
        scale = context.preferences.system.ui_scale
        letters = max(20, int(context.region.width / (_LETTER_PX * scale)) - 4)
        column = layout.box().column(align=True)
        for index, text in enumerate((f"{item.object}: {item.message}", item.remedy)):
            for number, line in enumerate(textwrap.wrap(text, letters)):
                icon = _ICONS[item.severity] if index == number == 0 else "BLANK1"
                column.label(text=line, icon=icon)
        row = layout.row(align=True)
        part = row.row(align=True)
        part.enabled = item.object != "the scene"
        part.operator("rfgs.select_finding", icon="RESTRICT_SELECT_OFF")
        part = row.row(align=True)
        part.enabled = item.repairable
        part.operator("rfgs.repair_finding", icon="TOOL_SETTINGS")
