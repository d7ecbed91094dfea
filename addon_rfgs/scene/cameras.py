# SPDX-License-Identifier: GPL-3.0-or-later
"""Pinhole cameras and radio devices of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import mathutils
import numpy as np

from ..errors import AddonError
from .bounds import Space
from .frames import file_label, unit_scale
from .overrides import Ring

#: Cameras set up around the scene where it brings none.
GUESSED_CAMERAS = 8
#: Opening angle of the longer side of a made-up camera, and the widest near walls [°].
_FOV_DEG, _WIDEST_DEG = 60.0, 105.0
#: Cameras inside a room keep this far from its walls [m].
_FROM_WALLS_M = 0.2


@dataclass
class View:
    """One camera as it renders: fixed, perspective, square pixels."""

    name: str
    """cam00, cam01, … by object name."""
    source: str
    """Name of the camera object."""
    data: bpy.types.Camera
    """Lens settings to copy."""
    world_from_camera: np.ndarray  # [4, 4], Blender units, OpenGL axes
    intrinsics: dict[str, float]
    """width, height [px], fl_x, fl_y, cx, cy [px]."""

    def row(self, unit: float) -> dict[str, Any]:
        """Row of `bundle.json`; `unit` is metres per Blender unit."""
        matrix = self.world_from_camera.copy()
        matrix[:3, 3] *= unit
        return {
            "name": self.name,
            "source": self.source,
            **self.intrinsics,
            "world_from_camera": matrix.tolist(),
        }


def picture_size(scene: bpy.types.Scene, resolution: int | None) -> tuple[int, int]:
    """Width and height [px]: the scene's aspect with `resolution` as the longer side."""
    render = scene.render
    width, height = render.resolution_x, render.resolution_y
    if not resolution:
        factor = render.resolution_percentage / 100
        return max(1, int(width * factor)), max(1, int(height * factor))
    if resolution < 8:
        raise AddonError(f"resolution: expected at least 8 pixels, got {resolution}")
    factor = resolution / max(width, height)
    return max(1, round(width * factor)), max(1, round(height * factor))


def find_views(
    scene: bpy.types.Scene,
    count: int | None,
    resolution: int | None,
    ring: list[bpy.types.Object] | None = None,
) -> tuple[list[View], list[dict[str, Any]]]:
    """The first `count` perspective cameras by name, as they stand in the first frame.

    Args:
        scene: The scene.
        count: How many, None for all.
        resolution: Longer side [px], None for the scene's.
        ring: Cameras that were made up, to be used instead of the scene's.

    Returns:
        Views and what was guessed: cameras that move, are left out or were made up.

    Raises:
        AddonError: More cameras are asked for than there are.
    """
    guesses: list[dict[str, Any]] = []
    scene.frame_set(scene.frame_start)
    graph = bpy.context.evaluated_depsgraph_get()
    width, height = picture_size(scene, resolution)
    found = (item for item in scene.objects if item.type == "CAMERA") if ring is None else ring
    cameras = sorted(found, key=lambda item: item.name)
    views = []
    for item in cameras:
        if item.data.type != "PERSP":
            note = {"what": "camera", "object": item.name, "value": "left out"}
            guesses.append({**note, "why": f"{item.data.type.lower()} projection"})
            continue
        evaluated = item.evaluated_get(graph)
        matrix = np.array(evaluated.matrix_world, dtype=np.float64)
        lens, rigid = _intrinsics(evaluated, width, height), _rigid(matrix)
        if (rigid[:3, :3] != _unscaled(matrix)).any():
            note = {"what": "camera", "object": item.name, "value": "straightened"}
            guesses.append({**note, "why": "something above it mirrors or shears it"})
        views.append(View(f"cam{len(views):02d}", item.name, item.data, rigid, lens))
    if not views:
        raise AddonError(f"{file_label()}: no perspective camera; add one")
    if count is not None and count > len(views):
        raise AddonError(f"cameras: {count} asked for, {file_label()} has {len(views)}")
    views = views[:count] if count else views
    guesses.extend(
        _moving(scene, "camera", {view.source: view.world_from_camera for view in views})
    )
    guesses.extend(_zooming(scene, views, (width, height)))
    return views, guesses


def perspective_cameras(scene: bpy.types.Scene) -> list[str]:
    """Names of the scene's own cameras that can be used."""
    items = [item for item in scene.objects if item.type == "CAMERA"]
    return sorted(item.name for item in items if item.data.type == "PERSP")


@contextmanager
def cameras_ready(
    scene: bpy.types.Scene, space: Space, ring: Ring | None
) -> Iterator[tuple[list[bpy.types.Object] | None, list[dict[str, Any]]]]:
    """Stands a ring of cameras around what moves where a scene has none, or where one is asked for.

    Args:
        scene: The scene.
        space: Where things are.
        ring: What the user wants, None to help only where no camera is.

    Yields:
        The made-up cameras, gone after the block, or None; and what was guessed.
    """
    if ring is None and perspective_cameras(scene):
        yield None, []
        return
    guesses = []
    if ring is None:
        ring = Ring(GUESSED_CAMERAS)
        note = {"what": "camera", "object": "the scene", "value": f"a ring of {ring.ring}"}
        guesses.append({**note, "why": "the scene has no perspective camera"})
    made = []
    width, height = picture_size(scene, None)
    aspect = min(width, height) / max(width, height)
    for index, (matrix, fov_deg) in enumerate(_stands(space, ring, aspect)):
        item = bpy.data.objects.new(f"RFGS guessed {index:02d}", bpy.data.cameras.new("guessed"))
        item.data.angle = np.radians(fov_deg)
        matrix[:3, 3] /= unit_scale(scene)
        item.data.clip_start, item.data.clip_end = 0.05 / unit_scale(scene), 200 / unit_scale(scene)
        item.matrix_world = mathutils.Matrix(matrix.tolist())
        scene.collection.objects.link(item)
        made.append(item)
    bpy.context.view_layer.update()
    try:
        yield made, guesses
    finally:
        for item in made:
            bpy.data.cameras.remove(item.data)


def _stands(space: Space, ring: Ring, aspect: float) -> list[tuple[np.ndarray, float]]:
    """Poses [4, 4] in metres and opening angles [°] of a ring around the middle of what moves.

    Where neither radius nor angle are given, a sphere around what moves fits into the picture,
    whose shorter side is `aspect` of the longer; within walls as far as a wide lens allows.
    """
    low, high = space.movers
    centre, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    fov_deg = ring.fov_deg or _FOV_DEG
    half_angle = np.arctan(np.tan(np.radians(fov_deg / 2)) * aspect)
    radius = ring.radius_m or 0.5 * size / np.sin(half_angle)
    poses = []
    for index in range(ring.ring):
        angle = 2 * np.pi * index / ring.ring
        lift = radius * (0.1 if index % 2 == 0 else 0.5)
        place = centre + np.array([radius * np.cos(angle), radius * np.sin(angle), lift])
        if ring.height_m is not None:
            place[2] = low[2] + ring.height_m
        if space.walled:
            inset = np.minimum(_FROM_WALLS_M, 0.25 * (space.bounds[1] - space.bounds[0]))
            place = np.clip(place, space.bounds[0] + inset, space.bounds[1] - inset)
        if ring.fov_deg is None:
            sine = min(0.5 * size / float(np.linalg.norm(place - centre)), 0.9)
            needed = 2 * np.degrees(np.arctan(np.tan(np.arcsin(sine)) / aspect))
            fov_deg = float(np.clip(needed, _FOV_DEG, _WIDEST_DEG))
        poses.append((look_at(place, centre), fov_deg))
    return poses


def look_at(place: np.ndarray, target: np.ndarray) -> np.ndarray:
    """world_from_camera [4, 4] of an upright camera at `place` that looks at `target`."""
    back = (place - target) / np.linalg.norm(place - target)
    right = np.cross([0.0, 0.0, 1.0], back)
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = place
    return matrix


def place_camera(scene: bpy.types.Scene, view: View) -> bpy.types.Object:
    """Adds a camera that stays at a view's pose and lens, whatever animates the original."""
    scene.frame_set(scene.frame_start)
    data = view.data.copy()
    data.animation_data_clear()
    item = bpy.data.objects.new(f"RFGS {view.name}", data)
    item.matrix_world = mathutils.Matrix(view.world_from_camera.tolist())
    data.dof.use_dof = False
    scene.collection.objects.link(item)
    return item


def find_devices(
    scene: bpy.types.Scene, chosen: tuple[dict[str, Any], ...] = ()
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Radio devices as they stand in the first frame, and what was guessed about them.

    Args:
        scene: The scene.
        chosen: Rows that take the place of the scene's own devices.
    """
    if chosen:
        return [dict(row) for row in chosen], []
    scene.frame_set(scene.frame_start)
    graph, unit = bpy.context.evaluated_depsgraph_get(), unit_scale(scene)
    marked = [item for item in scene.objects if item.rfgs.role != "NONE"]
    rows, poses = [], {}
    for item in sorted(marked, key=lambda item: item.name):
        matrix = item.evaluated_get(graph).matrix_world
        poses[item.name] = _rigid(np.array(matrix, dtype=np.float64))
        place, turn, _ = matrix.decompose()
        rows.append(
            {
                "name": item.name,
                "radio": item.rfgs.radio.strip() or "any",
                "role": item.rfgs.role,
                "position_m": [float(value) * unit for value in place],
                "quat_wxyz": [float(value) for value in turn.normalized()],
                "rf": item.rfgs.rf.row(),
            }
        )
    return rows, _moving(scene, "radio device", poses)


def _intrinsics(camera: bpy.types.Object, width: int, height: int) -> dict[str, float]:
    """Pinhole parameters from Blender's own projection matrix; x right, y down [px]."""
    graph = bpy.context.evaluated_depsgraph_get()
    matrix = np.array(camera.calc_matrix_camera(graph, x=width, y=height), dtype=np.float64)
    return {
        "width": width,
        "height": height,
        "fl_x": float(matrix[0, 0] * width / 2),
        "fl_y": float(matrix[1, 1] * height / 2),
        "cx": float(width / 2 * (1 - matrix[0, 2])),
        "cy": float(height / 2 * (1 + matrix[1, 2])),
    }


def _unscaled(matrix: np.ndarray) -> np.ndarray:
    """Axes [3, 3] of a matrix without their lengths, as Blender takes them to render."""
    return matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)


def _rigid(matrix: np.ndarray) -> np.ndarray:
    """The pose in a camera's matrix: it looks along the same line, and up is as near as can be.

    Empties above a camera may mirror it or, where scales differ, shear it; no dataset knows such
    cameras.
    """
    out = matrix.copy()
    axes = _unscaled(matrix)
    across = np.cross(axes[:, 1], axes[:, 2])
    across /= np.linalg.norm(across)
    straight = np.stack([across, np.cross(axes[:, 2], across), axes[:, 2]], axis=1)
    # Rounding is left alone: pictures would differ in nothing but their last bits.
    out[:3, :3] = axes if np.allclose(axes, straight, atol=1e-4) else straight
    return out


def _zooming(
    scene: bpy.types.Scene, views: list[View], size: tuple[int, int]
) -> list[dict[str, Any]]:
    """Notes about cameras whose lens in later frames differs from that of the first."""
    notes = {}
    for frame in (scene.frame_end, (scene.frame_start + scene.frame_end) // 2):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        for view in views:
            now = _intrinsics(scene.objects[view.source].evaluated_get(graph), *size)
            if not np.allclose([*now.values()], [*view.intrinsics.values()], rtol=1e-5):
                note = {"what": "camera", "object": view.source}
                note |= {"value": f"lens of frame {scene.frame_start}"}
                notes[view.source] = {**note, "why": "it zooms; a camera of a dataset has one lens"}
    return list(notes.values())


def _moving(
    scene: bpy.types.Scene, what: str, poses: dict[str, np.ndarray]
) -> list[dict[str, Any]]:
    """Notes about objects whose pose in later frames differs from `poses` of the first."""
    notes = {}
    for frame in (scene.frame_end, (scene.frame_start + scene.frame_end) // 2):
        scene.frame_set(frame)
        for name, pose in poses.items():
            now = _rigid(np.array(scene.objects[name].matrix_world, dtype=np.float64))
            if not np.allclose(now, pose, atol=1e-4):
                note = {"what": what, "object": name, "value": f"pose of frame {scene.frame_start}"}
                notes[name] = {**note, "why": f"it moves; a {what} of a dataset stands still"}
    return list(notes.values())
