# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -b FILE --command rfgs …`."""

from __future__ import annotations

from typing import Any

import bpy

_handle: Any = None


def _run(arguments: list[str]) -> int:
    # Imported on use: Blender starts faster, and only commands need argparse and numpy.
    from .cli import run

    return run(arguments, "blender -b FILE --command rfgs")


def register() -> None:
    """Adds the command `rfgs`."""
    global _handle
    _handle = bpy.utils.register_cli_command("rfgs", _run)


def unregister() -> None:
    """Removes the command."""
    global _handle
    if _handle is not None:
        bpy.utils.unregister_cli_command(_handle)
        _handle = None
