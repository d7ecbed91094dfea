# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that draws the channels of a link."""

from __future__ import annotations

from typing import Any

import bpy

from ..errors import AddonError
from ..jobs.environment import interpreter
from ..jobs.preferences import environment_path
from ..reporting import Progress, Reporting
from .drawing import Drawing, begin
from .image import load_image, show_image
from .waiting import begin_waiting, end_waiting, waits


class RFGS_OT_show_csi(Reporting, bpy.types.Operator):
    """Draw what was measured and what a run predicts of a link, and show it in an Image Editor.

    Blender goes on meanwhile; Esc gives it up
    """

    bl_idname = "rfgs.show_csi"
    bl_label = "Show CSI"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    _drawing: Drawing | None = None

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """One at a time."""
        if waits():
            cls.poll_message_set("A picture is being drawn already")
        return not waits()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[Any]:
        """Begins to draw in the background."""
        try:
            self._drawing = begin(context.scene, interpreter(environment_path()))
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
        drawing = self._drawing or begin(context.scene, interpreter(environment_path()))
        drawing.question.wait()
        told = drawing.outcome()
        image = load_image(drawing.out)
        if show_image(context, image):
            return f"{image.name}: {told}"
        return f"{image.name} is loaded, open an Image Editor to see it: {told}"
