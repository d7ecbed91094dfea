# SPDX-License-Identifier: Apache-2.0
"""Imported Gaussians for the tests inside Blender."""

from __future__ import annotations

from pathlib import Path

import bpy
from blank_file import open_blank_file

#: Frames of the run that the fixture `settings` imports.
FRAMES = (2, 5, 9)


def cloud(frame: int) -> bpy.types.Object:
    """The cloud of a frame."""
    return bpy.data.objects[f"Gaussians {frame:06d}"]


def only_cloud(path: Path) -> bpy.types.Object:
    """The cloud of one PLY in an empty file."""
    open_blank_file()
    bpy.context.scene.rfgs.gaussians.path = str(path)
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    return bpy.data.objects["Gaussians static"]
