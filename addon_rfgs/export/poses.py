# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses between frames, for radios that measure more often than the scene is animated."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import bpy

from ..errors import AddonError
from ..scene.frames import seconds_per_frame

#: Longest time between poses [s]; within it a spline follows a limb to a tenth of a millimetre.
POSE_STEP_S = 0.02
#: Fewest poses after a frame, for the spline's sake.
FEWEST = 4


def pose_table(scene: bpy.types.Scene, spans_s: list[float]) -> list[dict[str, Any]]:
    """When to evaluate the scene beside its frames.

    Poses are evenly spaced and end with the span, so that whoever interpolates never looks
    beyond the next frame, where an animation keyed on frames has its corners.

    Args:
        scene: Gives the frame rate.
        spans_s: Time after each frame to cover [s]; 0 for all of it until the next frame.

    Returns:
        One row per span: `span_s` as given and `offset_s`, the times after a frame [s].

    Raises:
        AddonError: A span is negative or longer than a frame.
    """
    frame_s = seconds_per_frame(scene)
    rows = []
    for span_s in spans_s:
        length_s = span_s or frame_s
        if not 0.0 < length_s <= frame_s * (1.0 + 1e-9):
            raise AddonError(
                f"span: expected 0 to {frame_s:g} s, the time between frames, got {span_s:g}"
            )
        count = max(FEWEST, math.ceil(length_s / POSE_STEP_S - 1e-9))
        offsets = [length_s * index / count for index in range(1, count + 1)]
        rows.append({"span_s": span_s, "offset_s": offsets})
    return rows


def pose_offsets(table: list[dict[str, Any]]) -> list[float]:
    """Every offset of a table once, ascending [s]."""
    return sorted({offset for row in table for offset in row["offset_s"]})


def at_offsets(scene: bpy.types.Scene, frame: int, offsets_s: list[float]) -> Iterator[float]:
    """Puts the scene at each time after a frame in turn; yields the offset [s]."""
    for offset_s in offsets_s:
        time = frame + offset_s / seconds_per_frame(scene)
        # A pose that closes a whole frame is the next frame, whatever the rounding.
        whole = math.floor(time + 1e-6)
        scene.frame_set(whole, subframe=max(0.0, time - whole))
        yield offset_s
