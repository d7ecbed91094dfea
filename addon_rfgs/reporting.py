# SPDX-License-Identifier: GPL-3.0-or-later
"""How operators answer: one line in the status bar, also for a user's mistake."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy

from .errors import AddonError, disk_message

Progress = Callable[[int, int], None]


def chosen_path(text: str) -> Path:
    """The path of a setting, `//` standing for the folder of the open file.

    Raises:
        AddonError: No path is set, or `//` is used in a scene that was never saved.
    """
    if not text:
        raise AddonError("no path is set")
    if text.startswith("//") and not bpy.data.filepath:
        raise AddonError("the scene was never saved; save it first")
    return Path(bpy.path.abspath(text))


class Reporting:
    """Runs `work(context, progress)` and reports its one line, or the user's mistake."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Runs `work` and reports its one line."""
        manager = context.window_manager
        manager.progress_begin(0, 1)
        try:
            self.report({"INFO"}, self.work(context, self._progress(manager)))
        except AddonError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except OSError as error:
            self.report({"ERROR"}, disk_message(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        return {"FINISHED"}

    @staticmethod
    def _progress(manager: bpy.types.WindowManager) -> Progress:
        return lambda done, total: manager.progress_update(done / total)
