# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m addon_rfgs --blend FILE COMMAND …`, with Blender as a Python module."""

from __future__ import annotations

import atexit
import os
import sys
from pathlib import Path

import bpy

from . import register, unregister
from .cli import USER_ERROR, run
from .scene.scripts import close_scripted_file


def main(arguments: list[str]) -> int:
    """Runs one command on a .blend; returns the exit code."""
    program = "python -m addon_rfgs --blend FILE"
    register()
    if arguments[:1] in (["-h"], ["--help"]):
        return run(["--help"], program)
    if len(arguments) < 2 or arguments[0] != "--blend":
        sys.stderr.write(f"error: expected {program} COMMAND …\n")
        return USER_ERROR
    atexit.register(close_scripted_file)
    return run(arguments[2:], program, Path(arguments[1]))


if __name__ == "__main__":
    code = main(sys.argv[1:])
    if bpy.app.version < (4, 3, 0):
        # As a module it frees panels at exit after Python is gone, and crashes with all work done.
        unregister()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
