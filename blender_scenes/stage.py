# SPDX-License-Identifier: GPL-3.0-or-later
"""What watches and lights a scene: cameras, access points, lamps and render settings."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix, Vector

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


def add_lights(collection: bpy.types.Collection) -> None:
    """Afternoon sun through the east window, a soft ceiling and the floor lamp."""
    sun = _light("sun", "SUN", 5.0, (1.0, 0.90, 0.76), collection)
    sun.data.angle = 0.02
    sun.rotation_euler = Vector((-0.80, 0.12, -0.70)).to_track_quat("-Z", "Y").to_euler()
    for name, place, size, power, colour in (
        ("soft_ceiling", (0.0, 0.0, 2.58), (3.6, 2.8), 62.0, (1.0, 0.96, 0.90)),
        ("window_glow", (2.94, -0.35, 1.52), (1.7, 1.25), 42.0, (0.86, 0.93, 1.0)),
    ):
        lamp = _light(name, "AREA", power, colour, collection)
        lamp.data.shape, lamp.data.size, lamp.data.size_y = "RECTANGLE", *size
        lamp.location = place
        lamp.visible_camera = lamp.visible_glossy = False
    collection.objects["window_glow"].rotation_euler = (0.0, math.radians(90), 0.0)
    bulb = _light("floor_lamp_bulb", "POINT", 9.0, (1.0, 0.78, 0.5), collection)
    bulb.data.shadow_soft_size = 0.05
    bulb.location = (-1.42, -2.10, 1.45)


def _light(
    name: str,
    kind: str,
    power: float,
    colour: tuple[float, float, float],
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = power, colour
    lamp = bpy.data.objects.new(name, data)
    collection.objects.link(lamp)
    return lamp


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
