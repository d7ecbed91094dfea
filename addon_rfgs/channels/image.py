# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as images of the open file, shown where an Image Editor is open."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..errors import AddonError

#: Custom property of the images that were loaded here.
_OURS = "rfgs"


def load_image(path: Path) -> bpy.types.Image:
    """The picture as an image of this file; one that was loaded before is read again.

    Raises:
        AddonError: It is missing or no picture.
    """
    if not path.is_file():
        raise AddonError(f"{path}: no such picture")
    known = set(bpy.data.images)
    image = bpy.data.images.load(str(path.resolve()), check_existing=True)
    image.reload()
    if not image.size[0]:
        if image not in known:
            bpy.data.images.remove(image)
        raise AddonError(f"{path}: not a picture that Blender can read")
    if image not in known:
        image[_OURS] = True
    return image


def remove_images() -> None:
    """Takes the images that were loaded here out of the file; their pictures stay on disk."""
    for image in [image for image in bpy.data.images if _OURS in image]:
        bpy.data.images.remove(image)


def show_image(context: bpy.types.Context, image: bpy.types.Image) -> bool:
    """Shows an image in the first Image Editor, of this window if it has one; opens none.

    Returns:
        Whether there is one.
    """
    windows = [context.window] if context.window else []
    windows += context.window_manager.windows
    for window in windows:
        for area in window.screen.areas:
            if area.ui_type == "IMAGE_EDITOR":  # and no UV editor, which is of the same type
                area.spaces.active.image = image
                area.tag_redraw()
                return True
    return False
