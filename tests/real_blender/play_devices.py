# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: devices are placed by a button, drawn, and drawn no more."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Photographs the 3D view with and without the overlay, and the sidebar."""
    yield from stage.open_tab()
    scene = bpy.context.scene
    for item in [item for item in scene.objects if item.rfgs.role != "NONE"]:
        bpy.data.objects.remove(item)
    view = stage.view.spaces.active.region_3d
    view.view_perspective = "PERSP"
    bpy.ops.rfgs.place_radio(radio="wifi")
    for item in scene.objects:
        # Looked at from close by; walls would be in the way.
        item.hide_set(item.name != "wifi_0")
    with stage.override():
        bpy.ops.view3d.view_all()
    for overlay in (True, False):
        scene.rfgs.devices.overlay = overlay
        yield from stage.shoot(f"overlay_{'on' if overlay else 'off'}", "VIEW")
    scene.rfgs.devices.overlay = True
    for item in scene.objects:
        item.hide_set(False)
    with stage.override():
        bpy.ops.view3d.view_axis(type="TOP")
        bpy.ops.view3d.view_all()
    view.view_perspective = "PERSP"
    stage.view.spaces.active.shading.type = "WIREFRAME"
    yield 1.0
    yield from stage.shoot("devices")
    yield from stage.click("rfgs.add_device")
    roles = sorted(item.rfgs.role for item in scene.objects if item.rfgs.role != "NONE")
    assert len(roles) == 5, roles
    assert bpy.context.view_layer.objects.active.rfgs.role in {"TRANSMITTER", "RECEIVER"}
