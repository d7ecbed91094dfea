# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks the findings as out of date when Undo or Redo puts another scene below them."""

import bpy
from bpy.app.handlers import persistent

_HANDLERS = (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post)


@persistent
def _age(*_scene_and_graph: object) -> None:
    check = bpy.context.window_manager.rfgs.check
    check.outdated = bool(check.summary)


def register() -> None:
    """Begins to listen for Undo and Redo."""
    for handlers in _HANDLERS:
        handlers.append(_age)


def unregister() -> None:
    """Listens no more."""
    for handlers in _HANDLERS:
        handlers.remove(_age)
