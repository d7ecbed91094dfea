# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured and predicted channels as an image; the picture comes from `rfgs csi`."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..errors import AddonError
from ..reporting import Progress, Reporting, chosen_path


def load_image(path: Path) -> bpy.types.Image:
    """The picture as an image of this file; one that was loaded before is read again.

    Raises:
        AddonError: It is missing or no picture.
    """
    if not path.is_file():
        raise AddonError(f"{path}: no such picture; `rfgs csi RUN` writes one")
    known = set(bpy.data.images)
    image = bpy.data.images.load(str(path.resolve()), check_existing=True)
    image.reload()
    if not image.size[0]:
        if image not in known:
            bpy.data.images.remove(image)
        raise AddonError(f"{path}: not a picture that Blender can read")
    return image


class RFGS_OT_show_csi(Reporting, bpy.types.Operator):
    """Load the picture of measured and predicted channels and show it in an open Image Editor."""

    bl_idname = "rfgs.show_csi"
    bl_label = "Show CSI"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Loads the panel's picture; the first Image Editor of the window shows it."""
        image = load_image(chosen_path(context.scene.rfgs.gaussians.image_path))
        areas = context.window.screen.areas if context.window else []
        for area in areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = image
                return f"Showing {image.name}"
        return f"Loaded {image.name}; open an Image Editor to see it"
