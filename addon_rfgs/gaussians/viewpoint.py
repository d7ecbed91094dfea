# SPDX-License-Identifier: GPL-3.0-or-later
"""From where imported Gaussians are seen well: a camera of the scene, or one made for it."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import mathutils
import numpy as np

from ..errors import AddonError
from ..scene.cameras import look_at
from .attributes import positions
from .clouds import Imported
from .display import Display, shown

#: Gaussians that vote for a camera.
_VOTERS = 200
#: Marks a camera that is not the scene's own.
MADE = "rfgs_made"
#: Rays end so far before a Gaussian, so that the person does not hide its own [units].
_FREE = 0.5


def cameras_of(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """The scene's own cameras by name, those in perspective."""
    return {
        item.name: item
        for item in scene.objects
        if item.type == "CAMERA" and item.data.type == "PERSP" and not item.get(MADE)
    }


def choose_camera(
    scene: bpy.types.Scene, imported: Imported, display: Display, wanted: str | None
) -> bpy.types.Object:
    """The wanted camera, else the one that sees most of the visible cloud, and sees it large."""
    cameras = cameras_of(scene)
    if wanted:
        return cameras[wanted]
    points = shown_points(imported, display)
    scores = {name: _score(scene, item, points) for name, item in cameras.items()}
    best = max(sorted(scores), key=lambda name: scores[name], default=None)
    if best is not None and scores[best] > 0:
        return cameras[best]
    low, high = points.min(axis=0), points.max(axis=0)
    centre, reach = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 0.5)
    camera = bpy.data.objects.new("RFGS view", bpy.data.cameras.new("RFGS view"))
    camera[MADE] = True
    camera.data.angle = np.radians(60)
    place = centre + 1.6 * reach * np.array([0.6, -0.74, 0.3])
    camera.matrix_world = mathutils.Matrix(look_at(place, centre).tolist())
    scene.collection.objects.link(camera)
    return camera


def shown_points(imported: Imported, display: Display) -> np.ndarray:
    """World positions [M, 3] of some Gaussians of the current frame, what moves before what not."""
    moving = [item for item in imported.objects if item.animation_data]
    for items in ([item for item in moving if not item.hide_viewport], imported.objects):
        found = [np.zeros((0, 3))]
        for item in items:
            visible = positions(item.data)[shown(item, display)]
            found.append(visible * np.array(item.scale))
        points = np.concatenate(found)
        if len(points):
            return points[:: max(1, len(points) // _VOTERS)]
    raise AddonError(
        "no Gaussian is left by opacity threshold "
        f"{display.opacity_threshold}, power threshold and crop box; lower them"
    )


def _score(scene: bpy.types.Scene, camera: bpy.types.Object, points: np.ndarray) -> float:
    """Share of points in view and in sight, times the square root of the area they cover."""
    graph = bpy.context.evaluated_depsgraph_get()
    matrix = np.array(camera.matrix_world, dtype=np.float64)
    size = (scene.render.resolution_x, scene.render.resolution_y)
    lens = np.array(camera.calc_matrix_camera(graph, x=size[0], y=size[1]), dtype=np.float64)
    local = np.linalg.inv(matrix) @ np.concatenate([points, np.ones((len(points), 1))], 1).T
    clip = lens @ local
    plane = clip[:2] / np.where(clip[3] > 1e-6, clip[3], np.inf)
    inside = (clip[3] > 1e-6) & (np.abs(plane) < 0.95).all(axis=0)
    if not inside.any():
        return 0.0
    free = sum(not hit for hit, _ in sight_lines(scene, camera, points[inside]))
    area = float(np.prod(np.ptp(plane[:, inside], axis=1) / 2))
    return free / len(points) * np.sqrt(min(area, 0.5))


def sight_lines(
    scene: bpy.types.Scene, camera: bpy.types.Object, points: np.ndarray
) -> Iterator[tuple[bool, bpy.types.Object | None]]:
    """Whether something stands between a camera and each of some points [M, 3], and what."""
    graph = bpy.context.evaluated_depsgraph_get()
    eye = camera.matrix_world.translation
    for point in points:
        line = mathutils.Vector(point) - eye
        ahead, far = line.normalized(), max(line.length - _FREE, 0.01)
        hit = scene.ray_cast(graph, eye + ahead * 0.05, ahead, distance=far)
        yield hit[0], hit[4]
