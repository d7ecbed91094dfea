# SPDX-License-Identifier: GPL-3.0-or-later
"""What is seen when: visibility is keyed, so files show it without the add-on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

_VISIBILITY = ("hide_viewport", "hide_render")


def key_visibility(
    scene: bpy.types.Scene,
    items: Iterable[tuple[int, bpy.types.Object]],
    offset: int = 0,
    interpolation: str = "HOLD",
    recorded: Iterable[int] = (),
) -> None:
    """Keys when objects of recorded frames are visible, in place of earlier keys.

    Args:
        scene: Whose current frame decides what is seen now.
        items: The frame of each object, and the object.
        offset: What belongs to frame f is shown at frame f + offset.
        interpolation: `NONE` shows an object at its own frame alone, `NEAREST` while no other
            recorded frame is nearer, `HOLD` until the next recorded frame.
        recorded: Frames that were recorded as well, with nothing to show.
    """
    rows = list(items)
    frames = sorted({*recorded, *(frame for frame, _ in rows)})
    spans = dict(zip(frames, _spans(frames, interpolation), strict=True))
    for frame, item in rows:
        first, last = (None if end is None else end + offset for end in spans[frame])
        _drop_keys(item)
        keys = [] if first is None else [(first - 1, True)]
        keys += [(frame + offset if first is None else first, False)]
        keys += [] if last is None else [(last + 1, True)]
        # Blender looks at keys of what is hidden only when the frame changes.
        now = scene.frame_current
        hidden_now = (first is not None and now < first) or (last is not None and now > last)
        for name in _VISIBILITY:
            for at, hidden in keys:
                setattr(item, name, hidden)
                item.keyframe_insert(name, frame=at)
            setattr(item, name, hidden_now)


def _spans(frames: list[int], interpolation: str) -> list[tuple[int | None, int | None]]:
    """First and last frame at which each recorded frame is shown; None where there is no end."""
    spans: list[tuple[int | None, int | None]] = []
    for index, frame in enumerate(frames):
        earlier = frames[index - 1] if index else None
        later = frames[index + 1] if index + 1 < len(frames) else None
        if interpolation == "NONE":
            spans.append((frame, frame))
        elif interpolation == "NEAREST":
            first = None if earlier is None else (earlier + frame) // 2 + 1
            spans.append((first, None if later is None else (frame + later) // 2))
        else:
            spans.append((frame, None if later is None else later - 1))
    return spans


def _drop_keys(item: bpy.types.Object) -> None:
    """Removes the keys of visibility and leaves every other animation of the object alone."""
    action = item.animation_data.action if item.animation_data else None
    if action is None:
        return
    for curves in curve_lists(action):
        for curve in [curve for curve in curves if curve.data_path in _VISIBILITY]:
            curves.remove(curve)


def curve_lists(action: Any) -> list[Any]:
    """Every list of curves of an action."""
    if hasattr(action, "fcurves"):
        return [action.fcurves]
    # Blender 5.0 keeps curves in the channel bags of strips.
    strips = [strip for layer in action.layers for strip in layer.strips]
    return [bag.fcurves for strip in strips for bag in strip.channelbags]
