# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws radio devices in the 3D view; adds nothing to the file."""

from __future__ import annotations

from typing import Any

import blf
import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader

from ..scene.frames import unit_scale
from .empties import devices, pose_of, radio_fields
from .sketch import joined, sketch

#: Linear RGBA.
_COLOURS = {
    "tx": (1.0, 0.38, 0.06, 1.0),
    "rx": (0.1, 0.55, 1.0, 1.0),
    "boresight": (0.95, 0.95, 0.95, 0.8),
}
_LINE_PX, _TEXT_PX, _TEXT_GAP_PX = 1.5, 11, 10

_handles: list[Any] = []


def register() -> None:
    """Adds the overlay, unless there is no window to draw in."""
    if bpy.app.background:
        return
    add = bpy.types.SpaceView3D.draw_handler_add
    _handles.append(add(_draw_lines, (), "WINDOW", "POST_VIEW"))
    _handles.append(add(_draw_names, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    """Removes the overlay."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def _shown(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Devices to draw in the view at hand."""
    space = context.space_data
    if not context.scene.rfgs.devices.overlay or not space.overlay.show_overlays:
        return []
    return [item for item in devices(context.scene) if item.visible_get(viewport=space)]


def _draw_lines() -> None:
    context = bpy.context
    items = _shown(context)
    if not items:
        return
    unit = unit_scale(context.scene)
    lines = joined(
        sketch(radio_fields(item), item.rfgs.role, pose_of(item, unit)) for item in items
    )
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE")
    try:
        shader.bind()
        shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        shader.uniform_float("lineWidth", _LINE_PX * context.preferences.system.ui_scale)
        for part, colour in _COLOURS.items():
            points = (getattr(lines, part).reshape(-1, 3) / unit).astype(np.float32)
            if len(points):
                shader.uniform_float("color", colour)
                batch_for_shader(shader, "LINES", {"pos": points}).draw(shader)
    finally:
        gpu.state.blend_set("NONE")


def _draw_names() -> None:
    context = bpy.context
    if not context.scene.rfgs.devices.names:
        return
    scale = context.preferences.system.ui_scale
    for item in _shown(context):
        place = location_3d_to_region_2d(
            context.region, context.region_data, item.matrix_world.translation
        )
        if place is not None:
            blf.size(0, _TEXT_PX * scale)
            blf.color(0, 1.0, 1.0, 1.0, 0.9)
            blf.position(0, place.x + _TEXT_GAP_PX * scale, place.y + _TEXT_GAP_PX * scale, 0)
            blf.draw(0, item.name)
