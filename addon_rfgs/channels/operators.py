# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that draws the channels of a link."""

from __future__ import annotations

from typing import Any

import bpy

from ..command import Command
from ..errors import AddonError
from ..jobs.preferences import InEnvironment
from ..reporting import Progress, Undoable, chosen_path
from .drawing import Drawing, begin
from .image import load_image, show_image
from .waiting import begin_waiting, end_waiting, waits


class RFGS_OT_show_csi(InEnvironment, Undoable, bpy.types.Operator):
    """Draw what was measured and what a run predicts of a link, and show it in an Image Editor.

    Blender goes on meanwhile; Esc gives it up
    """

    bl_label = "Show CSI"

    command = Command(
        "csi",
        reads={"channels": ("run_folder", "tx_device", "rx_device")},
        words={"run_folder": "--run", "filepath": "--out"},
    )

    filepath: bpy.props.StringProperty(
        name="File",
        description="PNG to write; empty: link_TX_RX.png in the predictions of the run",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    _drawing: Drawing | None = None

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """One at a time."""
        if waits():
            cls.poll_message_set("A picture is being drawn already")
        return not waits()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[Any]:
        """Begins to draw in the background."""
        try:
            self._drawing = self._begin(context)
        except AddonError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        begin_waiting(context, self._drawing)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[Any]:
        """Waits for the picture and lets every other event pass by."""
        assert self._drawing is not None
        if event.type == "ESC":
            self.cancel(context)
            self.report({"INFO"}, "The drawing was given up")
            return {"CANCELLED"}
        if event.type != "TIMER" or self._drawing.question.step():
            return {"PASS_THROUGH"}
        end_waiting()
        if context.area is not None:
            context.area.tag_redraw()  # The button can be pressed again.
        return self.execute(context)

    def cancel(self, _context: bpy.types.Context) -> None:
        """Gives up; Blender calls this too when another file is opened."""
        end_waiting()

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Shows the picture; called from a script, it is drawn first."""
        drawing = self._drawing or self._begin(context)
        drawing.question.wait()
        told = drawing.outcome()
        image = load_image(drawing.out)
        shown = bpy.app.background or show_image(context, image)
        hint = "" if shown else "; open an Image Editor to see it"
        return f"{drawing.out}: {told}{hint}"

    def _begin(self, context: bpy.types.Context) -> Drawing:
        out = chosen_path(self.filepath) if self.filepath else None
        return begin(context.scene, self.interpreter(), out)
