# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file says of itself at once, without a look at its meshes: frames and devices."""

from __future__ import annotations

from typing import Any

import bpy

from .cameras import find_devices
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
        `frames`, a list of numbers, and `devices`, rows with name, radio and role.

    Raises:
        AddonError: There is no such range of frames, or a name matches nothing.
    """
    with kept(scene) as keeper:
        apply(overrides, keeper, scene)
        disable_scripts(keeper, scene)
        numbers = chosen_frames(scene, frames, between=between)
        devices, _ = find_devices(scene, overrides.devices)
    return {
        "frames": numbers,
        "devices": [{name: row[name] for name in ("name", "radio", "role")} for row in devices],
    }
