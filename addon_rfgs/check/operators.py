# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons of the scene check."""

from __future__ import annotations

import bpy

from ..command import Command
from ..errors import AddonError
from ..reporting import Progress, Reporting, Undoable
from ..scene.findings import SEVERITIES, Finding
from ..scene_choice import SceneChoice, chosen_overrides
from . import commands, repairs, scene_repairs
from .settings import RFGS_PG_finding


def fill(context: bpy.types.Context, found: list[Finding]) -> str:
    """Puts findings into the list of the window; returns what they come to."""
    check = context.window_manager.rfgs.check
    check.rows.clear()
    check.outdated = False
    for finding in found:
        row = check.rows.add()
        row.severity = finding.severity.upper()
        for name in ("object", "message", "remedy", "kind", "material"):
            setattr(row, name, getattr(finding, name))
        row.repairable = repairs.repairable(context.scene, finding)
    check.active = min(check.active, max(len(found) - 1, 0))
    counts = [(sum(row.severity == name for row in found), name) for name in SEVERITIES]
    said = [f"{count} {name}{'s' * (count > 1)}" for count, name in counts if count]
    check.summary = ", ".join(said) or "Nothing is wrong"
    return check.summary


def _row(context: bpy.types.Context, index: int) -> RFGS_PG_finding:
    """A row of the list, the active one for -1.

    Raises:
        AddonError: There is none.
    """
    check = context.window_manager.rfgs.check
    index = check.active if index < 0 else index
    if index >= len(check.rows):
        raise AddonError("no such finding; check the scene first")
    return check.rows[index]


class _OnFinding(Undoable):
    """Acts on a row of the list."""

    index: bpy.props.IntProperty(
        name="Finding",
        description="Row of the list; -1 for the active one",
        default=-1,
        min=-1,
        # Hidden, as after a repair the list is another one: adjusting it would mean other rows.
        options={"SKIP_SAVE", "HIDDEN"},
    )

    @classmethod
    def ready(cls, context: bpy.types.Context) -> bool:
        """There is a list."""
        there = len(context.window_manager.rfgs.check.rows) > 0
        if not there:
            cls.poll_message_set("Press Check Scene first; nothing is listed")
        return there


class RFGS_OT_check_scene(SceneChoice, Reporting, bpy.types.Operator):
    """List what would go wrong with this scene: units, walls, people, materials, devices."""

    bl_label = "Check Scene"
    command = Command("check", add=commands.add_check, work=commands.check)

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Fills the list."""
        overrides = chosen_overrides(self)
        return fill(context, repairs.findings(context.scene, self.frames, overrides))


class RFGS_OT_select_finding(_OnFinding, bpy.types.Operator):
    """Select the object that a finding is about, and show it."""

    bl_label = "Select"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Selects and frames."""
        item = repairs.select_meant(context, _row(context, self.index).finding())
        _frame(context)
        return f"Selected {item.name}"


class RFGS_OT_repair_finding(_OnFinding, bpy.types.Operator):
    """Do what is safe about a finding, and check the scene again."""

    bl_label = "Fix"

    @classmethod
    def ready(cls, context: bpy.types.Context) -> bool:
        """There is a list, and it is about the scene as it is."""
        outdated = context.window_manager.rfgs.check.outdated
        if outdated:
            cls.poll_message_set("Undo or Redo changed the scene; check it again")
        return not outdated and super().ready(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks before everything changes its size."""
        try:
            finding = _row(context, self.index).finding()
            if finding.kind not in repairs.ASK_FIRST:
                return self.execute(context)
            unit = scene_repairs.likely_unit(context.scene)
        except AddonError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return context.window_manager.invoke_confirm(
            self,
            event,
            title="Change the Unit Scale",
            message=f"One unit becomes {unit:g} m, for everything in the scene",
            confirm_text="Change",
        )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Repairs."""
        done = repairs.repair(context.scene, _row(context, self.index).finding())
        context.view_layer.update()
        return (
            f"{done[0].upper()}{done[1:]}; left: {fill(context, repairs.findings(context.scene))}"
        )


def _frame(context: bpy.types.Context) -> None:
    """Brings the selection into the view that the button stands in."""
    area = context.area
    if bpy.app.background or area is None or area.type != "VIEW_3D":
        return
    region = next(item for item in area.regions if item.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.view3d.view_selected()
