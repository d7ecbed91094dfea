# SPDX-License-Identifier: GPL-3.0-or-later
"""A plain room around scenes that bring none, on request."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from .bounds import Space
from .findings import Finding
from .frames import unit_scale
from .overrides import Room
from .survey import Surface, surface_of

NAME = "RFGS room"
#: Walls keep this far from other static surfaces, so that none coincide [m].
_CLEAR_M = 0.05
#: Corners of a face seen from inside; each indexes the box's corners x + 2 y + 4 z.
_INWARD = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@contextmanager
def room_ready(
    scene: bpy.types.Scene, room: Room | None, surfaces: list[Surface], space: Space
) -> Iterator[None]:
    """Builds the room for the duration of the block; adds its surface and updates `space`."""
    if room is None:
        yield
        return
    crowded = any(not surface.moving for surface in surfaces)
    low, high = _corners(room, space, _CLEAR_M if crowded else 0.0)
    if (space.movers[0] < low - 1e-3).any() or (space.movers[1] > high + 1e-3).any():
        message = f"the room of {np.round(high - low, 2).tolist()} m is smaller than what moves"
        space.findings.append(Finding("error", "the scene", message, "enlarge room: size_m"))
    item = _build(scene, room, low / unit_scale(scene), high / unit_scale(scene))
    try:
        surfaces.append(surface_of(scene, item))
        space.bounds = np.stack([low, high])
        space.walled = True
        space.findings[:] = [row for row in space.findings if "there is no room" not in row.message]
        yield
    finally:
        mesh, material = item.data, item.data.materials[0]
        bpy.data.meshes.remove(mesh)
        bpy.data.materials.remove(material)


def _corners(room: Room, space: Space, clear: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = space.bounds[0] - clear, space.bounds[1] + clear
    if room.size_m:
        middle, half = 0.5 * (low + high), 0.5 * np.array(room.size_m)
        floor = low[2]
        low, high = middle - half, middle + half
        low[2], high[2] = floor, floor + room.size_m[2]
    return low, high


def _build(
    scene: bpy.types.Scene, room: Room, low: np.ndarray, high: np.ndarray
) -> bpy.types.Object:
    corners = [[(low, high)[(index >> axis) & 1][axis] for axis in range(3)] for index in range(8)]
    mesh = bpy.data.meshes.new(NAME)
    mesh.from_pydata(corners, [], [list(face) for face in _INWARD])
    material = bpy.data.materials.new(f"{NAME} {room.material}")
    material.rfgs.radio_material = room.material
    mesh.materials.append(material)
    item = bpy.data.objects.new(NAME, mesh)
    item.visible_shadow = False  # Lamps outside go on lighting the scene.
    scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item
