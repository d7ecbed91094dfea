# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves the open file for commands, beside the one that was opened."""

from __future__ import annotations

from pathlib import Path

import bpy

from .files import replacing


def save_copy(path: Path) -> None:
    """Writes the open file to `path`, whole or not at all."""
    with replacing(path) as temporary:
        bpy.ops.wm.save_as_mainfile(filepath=str(temporary.resolve()), compress=True, copy=True)
