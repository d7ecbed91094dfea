# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves the open file for commands, beside the one that was opened."""

from __future__ import annotations

from pathlib import Path

import bpy

from .errors import AddonError
from .files import replacing


def save_copy(path: Path) -> None:
    """Writes the open file to `path`, whole or not at all."""
    with replacing(path) as temporary:
        name = str(temporary.resolve())
        try:
            bpy.ops.wm.save_as_mainfile(filepath=name, compress=True, copy=True)
        except RuntimeError as error:  # what Blender reports, with the temporary name in it
            said = " ".join(str(error).removeprefix("Error: ").split()).replace(name, str(path))
            raise AddonError(f"{path}: cannot be written ({said})") from error
