# SPDX-License-Identifier: GPL-3.0-or-later
"""What watches a scene: cameras, access points and render settings."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

Point = tuple[float, float, float]


def add_cameras(
    places: Sequence[Point], subject: np.ndarray, collection: bpy.types.Collection
) -> list[bpy.types.Object]:
    """Adds cameras cam_00, cam_01, … that keep `subject` in their square picture.

    Args:
        places: Positions [m].
        subject: Points that must stay in the picture [m], shape (N, 3).
        collection: Where the cameras go.
    """
    made = []
    for index, place in enumerate(places):
        data = bpy.data.cameras.new(f"cam_{index:02d}")
        camera = bpy.data.objects.new(data.name, data)
        axes, data.angle = _aim(np.array(place), subject)
        data.clip_start, data.clip_end, data.display_size = 0.05, 30.0, 0.2
        camera.matrix_world = Matrix.Translation(place) @ Matrix(axes.tolist()).to_4x4()
        collection.objects.link(camera)
        made.append(camera)
    return made


def _aim(place: np.ndarray, subject: np.ndarray) -> tuple[np.ndarray, float]:
    """Axes (columns right, up, back) of an upright camera and its angle of view [rad]."""
    look = subject.mean(axis=0) - place
    low, high = np.zeros(2), np.zeros(2)
    axes = np.eye(3)
    # A few rounds centre the subject's extent in the picture, not its mean.
    for _ in range(20):
        back = -look / np.linalg.norm(look)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(back, right), back], axis=1)
        local = (subject - place) @ axes
        slopes = local[:, :2] / -local[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        middle = 0.5 * (low + high)
        look = axes @ np.array([middle[0], middle[1], -1.0])
    return axes, 2 * math.atan(1.06 * float(np.maximum(-low, high).max()))


def add_access_points(
    places: Sequence[Point], centre: tuple[float, float], collection: bpy.types.Collection
) -> list[bpy.types.Object]:
    """Adds Empties whose local +x looks across the room at `centre`."""
    made = []
    for index, place in enumerate(places):
        device = bpy.data.objects.new(f"access_point_{index}", None)
        device.empty_display_type, device.empty_display_size = "ARROWS", 0.15
        device.location = place
        yaw = math.atan2(centre[1] - place[1], centre[0] - place[0])
        device.rotation_euler = (0.0, 0.0, yaw)
        device.rfgs.role, device.rfgs.radio = "ACCESS_POINT", "any"
        collection.objects.link(device)
        made.append(device)
    return made


def set_render(scene: bpy.types.Scene, frames: int, fps: int) -> None:
    """Cycles, square pictures, view transform Standard, `frames` frames from 1."""
    scene.frame_start, scene.frame_end = 1, frames
    scene.render.fps, scene.render.fps_base = fps, 1.0
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = 64, True, 0
    scene.render.resolution_x = scene.render.resolution_y = 512
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.unit_settings.system, scene.unit_settings.length_unit = "METRIC", "METERS"
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.62, 0.76, 0.95, 1.0)
    background.inputs["Strength"].default_value = 0.5
    scene.world = world


def corners(
    half_m: tuple[float, float], heights_m: Sequence[float] = (1.2, 2.2), inset_m: float = 0.2
) -> list[Point]:
    """The four corners of a room, `inset_m` from its walls, at alternating heights [m]."""
    x, y = half_m[0] - inset_m, half_m[1] - inset_m
    around = [(-x, -y), (x, -y), (x, y), (-x, y)]
    return [(*place, heights_m[index % len(heights_m)]) for index, place in enumerate(around)]


def around_room(
    half_m: tuple[float, float], heights_m: Sequence[float] = (2.4, 1.5, 1.95)
) -> list[Point]:
    """Cameras at three heights in each corner, from where they see all of a room [m].

    Any first few of them look from all around.
    """
    made = []
    for round_ in range(len(heights_m)):
        places = corners(half_m, [heights_m[(round_ + k) % len(heights_m)] for k in range(4)])
        made += [places[index] for index in (0, 2, 1, 3)]
    return made


def show_first_camera(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Makes every 3D view of the file look through `camera`, with material colours."""
    scene.camera = camera
    for screen in bpy.data.screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D":
                    space.region_3d.view_perspective = "CAMERA"
                    space.shading.type, space.shading.color_type = "SOLID", "MATERIAL"
                    space.shading.show_cavity = True
