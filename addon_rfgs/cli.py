# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, the same for `blender --command rfgs` and `python -m addon_rfgs`."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import NoReturn, TextIO

import bpy

from .arguments import add_command
from .check.commands import FIX, OUTLINE
from .command import Command
from .devices.commands import LIST as LIST_DEVICES
from .errors import AddonError, disk_message
from .materials.commands import LIST as LIST_MATERIALS
from .registration import CLASSES

_GROUPS = {
    "devices": "list, import, capture, add, place, copy, mirror and remove radio devices",
    "materials": "list, guess, set and show radio materials",
}

#: Exit code of every mistake a user can repair.
USER_ERROR = 2


class _Parser(argparse.ArgumentParser):
    """Reports mistakes like every other error: one line."""

    def error(self, message: str) -> NoReturn:
        raise AddonError(f"{message} (see: {self.prog} --help)")


def commands() -> list[tuple[Command, type | None]]:
    """Every command with its operator; None for those that only look."""
    alone = [(command, None) for command in (LIST_DEVICES, LIST_MATERIALS, OUTLINE, FIX)]
    return [*alone, *((kind.command, kind) for kind in CLASSES if "command" in vars(kind))]


def parser(program: str) -> argparse.ArgumentParser:
    """The parser of all commands."""
    main = _Parser(prog=program, description="RF-GS inside Blender")
    top = main.add_subparsers(dest="command", required=True, metavar="COMMAND")
    groups = {
        name: top.add_parser(name, help=text, description=f"{text.capitalize()}.").add_subparsers(
            dest="task", required=True, metavar="TASK"
        )
        for name, text in _GROUPS.items()
    }
    for command, kind in commands():
        add_command(groups.get(command.name.split()[0], top), command, kind)
    return main


def run(arguments: Sequence[str], program: str = "rfgs", blend: Path | None = None) -> int:
    """Runs one command; returns its exit code.

    Args:
        arguments: What stands after the program's name.
        program: Name for messages.
        blend: File to open first; None takes the one that is open.
    """
    try:
        return _run(arguments, program, blend)
    except BrokenPipeError:  # Nobody reads the answer any more, as after `| head`.
        return 1


def _run(arguments: Sequence[str], program: str, blend: Path | None) -> int:
    with _quiet() as out:
        try:
            with redirect_stdout(out):  # for --help
                options = parser(program).parse_args(arguments)
            if blend is not None:
                open_blend(blend)
            out.write(options.run(options, out) + "\n")
            code = 0
        except BrokenPipeError:
            raise
        except AddonError as error:
            message, code = f"error: {error}\n", USER_ERROR
        except OSError as error:
            message, code = f"error: {disk_message(error)}\n", USER_ERROR
        except SystemExit as request:  # argparse after --help
            return int(request.code or 0)
    if code:
        sys.stderr.write(message)
        sys.stderr.flush()
    return code


def open_blend(path: Path) -> None:
    """Opens a file; scripts inside it never run.

    Raises:
        AddonError: The file does not exist or is not a .blend.
    """
    if not path.is_file():
        raise AddonError(f"{path}: no such .blend file")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), use_scripts=False)
    except RuntimeError as error:
        raise AddonError(f"{path}: not a .blend file that Blender can read") from error


@contextmanager
def _quiet() -> Iterator[TextIO]:
    """Keeps Blender's own chatter off the terminal; yields a stream that still reaches stdout.

    Blender prints from C, so the descriptors themselves are turned away. Should the block fail
    in an unforeseen way, the end of what was said goes to stderr.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    with tempfile.TemporaryFile() as log, os.fdopen(os.dup(1), "w") as out:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        failed = True
        try:
            yield out
            failed = False
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(saved[0], 1)
            os.dup2(saved[1], 2)
            for descriptor in saved:
                os.close(descriptor)
            if failed:
                log.seek(max(0, log.seek(0, os.SEEK_END) - 4000))
                sys.stderr.write(log.read().decode("utf-8", "replace"))
