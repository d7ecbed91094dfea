# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file says of itself at once, without a look at its meshes: frames, devices, numbers."""

from __future__ import annotations

from typing import Any

import bpy

from .cameras import GUESSED_CAMERAS, find_devices, perspective_cameras, picture_size
from .frames import chosen_frames
from .overrides import Overrides, apply
from .scripts import disable_scripts
from .state import kept


def outline(
    scene: bpy.types.Scene, frames: str | None, overrides: Overrides, *, between: bool = False
) -> dict[str, Any]:
    """Frames that would be used, and the radio devices.

    Args:
        scene: Scene of the open file.
        frames: `A:B[:STEP]`, None for the scene's range.
        overrides: What the user says about the scene beside the file.
        between: Whether poses until the next frame are wanted too (`frames.chosen_frames`).

    Returns:
        `frames`, a list of numbers; `devices`, rows with name, radio and role; and what time and
        disk go by: `cameras`, how many would render, `aspect`, shorter by longer side of a
        picture, `people`, how many there seem to be, and `fps`.

    Raises:
        AddonError: There is no such range of frames, or a name matches nothing.
    """
    with kept(scene) as keeper:
        apply(overrides, keeper, scene)
        disable_scripts(keeper, scene)
        numbers = chosen_frames(scene, frames, between=between)
        devices, _ = find_devices(scene, overrides.devices)
        ring = overrides.cameras.ring if overrides.cameras else 0
        size = picture_size(scene, None)
        people, fps = _people(scene), scene.render.fps / scene.render.fps_base
    return {
        "frames": numbers,
        "devices": [{name: row[name] for name in ("name", "radio", "role")} for row in devices],
        "cameras": ring or len(perspective_cameras(scene)) or GUESSED_CAMERAS,
        "aspect": min(size) / max(size),
        "people": people,
        "fps": fps,
    }


def _people(scene: bpy.types.Scene) -> int:
    """Armatures that carry meshes, and meshes of the class Person without one."""
    found = set()
    for item in scene.objects:
        if item.type == "MESH" and item.rfgs.object_class != "IGNORE":
            armature = item.find_armature()
            if armature is not None or item.rfgs.object_class == "PERSON":
                found.add(armature or item)
    return len(found)
