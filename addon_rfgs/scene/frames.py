# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame ranges, units and the name of the open file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy

from ..errors import AddonError
from ..files import sha256
from ..naming import closest

_PATTERN = re.compile(r"\s*(-?\d+)\s*:\s*(-?\d+)\s*(?::\s*(\d+)\s*)?")


def chosen_frames(scene: bpy.types.Scene, text: str | None, *, between: bool = False) -> list[int]:
    """Frame numbers of `A:B[:STEP]`, both ends included; nothing means what the scene renders.

    Args:
        scene: Gives the range.
        text: What the user asked for.
        between: Whether poses until the next frame are wanted too: the range's last frame has
            none and is left out.

    Raises:
        AddonError: The scene has no range, or `text` is no range within it.
    """
    first, last = scene.frame_start, scene.frame_end
    if last <= first:
        raise AddonError(
            f"{file_label()}: the scene has no frame range ({first}:{last}); "
            "set Start and End in its output properties, or give a frame range"
        )
    last -= int(between)
    if not text:
        return list(range(first, last + 1, scene.frame_step))
    match = _PATTERN.fullmatch(text)
    if not match:
        raise AddonError(f"frames: expected FIRST:LAST or FIRST:LAST:STEP, got {text!r}")
    start, end, step = int(match[1]), int(match[2]), int(match[3] or 1)
    if start > end or step < 1:
        raise AddonError(f"frames: expected FIRST <= LAST and STEP >= 1, got {text!r}")
    if start < first or end > last:
        why = ", whose last frame no packet can follow" if between else ""
        raise AddonError(f"frames: {text} leaves the range {first}:{last} of {file_label()}{why}")
    return list(range(start, end + 1, step))


def unit_scale(scene: bpy.types.Scene) -> float:
    """Metres per Blender unit."""
    units = scene.unit_settings
    return 1.0 if units.system == "NONE" else float(units.scale_length)


def file_label() -> str:
    """Name of the open file for messages."""
    return bpy.data.filepath or "the unsaved scene"


def named(known: Mapping[str, Any], name: str, what: str) -> Any:
    """What has a name.

    Raises:
        AddonError: Nothing has it; the message says which names look like it.
    """
    if name not in known:
        raise AddonError(f"{file_label()}: no {what} {name!r}{closest(name, known.keys())}")
    return known[name]


def file_sha256() -> str:
    """SHA-256 of the open file as it lies on disk.

    Raises:
        AddonError: The file was never saved.
    """
    if not bpy.data.filepath:
        raise AddonError("the scene was never saved; save it first")
    return sha256(Path(bpy.data.filepath))


def seconds_per_frame(scene: bpy.types.Scene) -> float:
    """Time from one frame to the next [s]."""
    return float(scene.render.fps_base / scene.render.fps)
