# SPDX-License-Identifier: GPL-3.0-or-later
"""How operators answer: one line in the status bar or of a command, also for a user's mistake."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

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


class _Listener:
    """A command, which hears what the operator that it calls would tell the status bar."""

    def __init__(self, out: TextIO) -> None:
        self.out = out
        self.line = ""
        self.error: BaseException | None = None

    def say(self, line: str) -> None:
        """Writes a line at once."""
        self.out.write(f"{line}\n")
        self.out.flush()

    def progress(self, done: int, total: int) -> None:
        """Writes how far it is."""
        self.say(f"progress {done} {total}")


_listener: _Listener | None = None


def note(line: str) -> None:
    """Tells a command's user something before its work is done; an operator's user is not told."""
    if _listener is not None:
        _listener.say(f"note: {line}")


def call(operator: str, out: TextIO, **values: Any) -> str:
    """Runs an operator for a command.

    Args:
        operator: Its name behind `rfgs.`.
        out: Takes lines on how far it is.
        **values: Its properties.

    Returns:
        Its one line.

    Raises:
        AddonError: What the operator refused; any other exception of it passes, too.
    """
    global _listener
    _listener = heard = _Listener(out)
    try:
        getattr(bpy.ops.rfgs, operator)(**values)
    finally:
        _listener = None
    if heard.error is not None:
        raise heard.error
    return f"{heard.line[0].lower()}{heard.line[1:]}"


class Reporting:
    """Runs `work(context, progress)` and reports its one line, or the user's mistake."""

    def __init_subclass__(cls) -> None:
        """Names an operator after its class: `RFGS_OT_add_device` is `rfgs.add_device`."""
        super().__init_subclass__()
        if cls.__name__.startswith("RFGS_OT_"):
            cls.bl_idname = f"rfgs.{cls.__name__.removeprefix('RFGS_OT_')}"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the button can be pressed; a command is told by `work` why it cannot be done."""
        return _listener is not None or cls.ready(context)

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """Whether there is something to work on."""
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Runs `work` and reports its one line."""
        if _listener is not None:
            return self._answer(context, _listener)
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

    def say(self, line: str) -> None:
        """Tells something before the work is done."""
        if _listener is not None:
            _listener.say(line)
        else:
            self.report({"WARNING"}, line)

    def _answer(self, context: bpy.types.Context, listener: _Listener) -> set[str]:
        try:
            listener.line = self.work(context, listener.progress)
        except BaseException as error:
            # Blender would make a text of it; the command raises it again.
            listener.error = error
            return {"CANCELLED"}
        return {"FINISHED"}

    @staticmethod
    def _progress(manager: bpy.types.WindowManager) -> Progress:
        return lambda done, total: manager.progress_update(done / max(total, 1))


class Undoable(Reporting):
    """The same of what changes the file."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
