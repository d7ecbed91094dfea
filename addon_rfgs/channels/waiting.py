# SPDX-License-Identifier: GPL-3.0-or-later
"""The one drawing that a window waits for, and what that holds of Blender."""

from __future__ import annotations

import bpy

from .drawing import Drawing

_EVERY_S = 0.2
_TOLD = "RF-GS draws the channels; Esc gives it up"


class Waiting:
    """A drawing, a timer that wakes Blender and a line in the status bar."""

    def __init__(self, context: bpy.types.Context, drawing: Drawing) -> None:
        self.drawing = drawing
        self._timer = context.window_manager.event_timer_add(_EVERY_S, window=context.window)
        self._workspace = context.workspace.name
        context.workspace.status_text_set(_TOLD)

    def end(self) -> None:
        """Takes timer and line away, and ends the program if it is not over."""
        self.drawing.question.cancel()
        bpy.context.window_manager.event_timer_remove(self._timer)
        workspace = bpy.data.workspaces.get(self._workspace)
        if workspace is not None:
            workspace.status_text_set(None)


_now: Waiting | None = None


def waits() -> bool:
    """Whether there is a drawing under way."""
    return _now is not None


def begin_waiting(context: bpy.types.Context, drawing: Drawing) -> None:
    """Waits for a drawing from now on; there must be no other."""
    global _now
    _now = Waiting(context, drawing)


def end_waiting() -> None:
    """Waits no more."""
    global _now
    if _now is not None:
        _now.end()
    _now = None


def register() -> None:
    """Nothing waits yet."""


def unregister() -> None:
    """Gives up the drawing that is under way."""
    end_waiting()
