# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of the scene check."""

from __future__ import annotations

from typing import Any

import bpy

from ..steps import Step
from ..tab import paragraph
from .settings import RFGS_PG_finding

_ICONS = {"ERROR": "CANCEL", "WARNING": "ERROR", "INFO": "INFO"}


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


class RFGS_PT_check(Step, bpy.types.Panel):
    """What would go wrong."""

    bl_label = "2 Check"
    step, icon = "check", "VIEWZOOM"

    @classmethod
    def waits_for(cls, scene: bpy.types.Scene) -> str:
        """Something that can be checked."""
        return "" if scene.objects else "an empty scene"

    @classmethod
    def taken(cls, _scene: bpy.types.Scene) -> str:
        """What the last check said, where nobody has to do anything about it."""
        check = bpy.context.window_manager.rfgs.check
        settled = not check.outdated and all(row.severity == "INFO" for row in check.rows)
        return check.summary if settled else ""

    def draw_step(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows the button, the list, and the active finding in full."""
        check = context.window_manager.rfgs.check
        layout.operator("rfgs.check_scene", icon="VIEWZOOM")
        if check.outdated:
            layout.label(text="Out of date: check again", icon="ERROR")
        elif check.summary:
            worst = _ICONS[check.rows[0].severity] if check.rows else "CHECKMARK"
            layout.label(text=check.summary, icon=worst)
        if not check.rows:
            return
        layout = layout.column()
        layout.active = not check.outdated
        layout.template_list("RFGS_UL_findings", "", check, "rows", check, "active", rows=5)
        if check.active >= len(check.rows):
            return
        item = check.rows[check.active]
        box = layout.box()
        paragraph(box, f"{item.object}: {item.message}", _ICONS[item.severity])
        paragraph(box, item.remedy, "BLANK1")
        row = layout.row(align=True)
        part = row.row(align=True)
        part.enabled = item.object != "the scene"
        part.operator("rfgs.select_finding", icon="RESTRICT_SELECT_OFF")
        part = row.row(align=True)
        part.enabled = item.repairable
        part.operator("rfgs.repair_finding", icon="TOOL_SETTINGS")
