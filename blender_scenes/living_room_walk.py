# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds living_room_walk: a furnished room and a person who walks through it."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np

import addon_rfgs
from blender_scenes.body import load_body
from blender_scenes.character import build_character
from blender_scenes.clothes import dress
from blender_scenes.furniture import build_furniture
from blender_scenes.gait import Gait
from blender_scenes.room import SIZE_M, build_room
from blender_scenes.stage import (
    add_access_points,
    add_cameras,
    add_lights,
    set_render,
    show_first_camera,
)
from blender_scenes.walk import key_walk, legs_of, walking_pose
from blender_scenes.walk_path import ArcPath

FRAMES, FPS = 60, 10
#: Through the middle of the room, between the rug and the television, past the dining table.
PATH = ArcPath((0.0, 0.24), math.radians(-3), 4.0, -math.radians(46))
#: The pelvis is at the path's beginning at this time of the gait [s].
START_S = Gait().stance * Gait().step_s
#: High in the corners, at eye height, and along the walls; any first few look from all around.
CAMERAS = (
    (-2.75, -2.25, 2.40),
    (2.75, 2.25, 2.40),
    (2.72, -2.28, 1.55),
    (-2.80, 2.28, 1.60),
    (0.30, 2.36, 1.75),
    (-0.35, -2.38, 2.20),
    (-2.70, -2.30, 1.50),
    (2.75, -2.25, 2.42),
    (2.80, 2.30, 1.78),
    (-2.75, 2.25, 2.42),
    (1.10, -2.38, 1.45),
    (-0.90, 2.36, 2.40),
)


def build(out: Path) -> None:
    """Builds the scene from nothing and saves it, compressed, as `out`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_rfgs.register()
    try:
        _fill(bpy.context.scene)
        bpy.context.preferences.filepaths.save_version = 0
        bpy.ops.wm.save_as_mainfile(filepath=str(out.resolve()), compress=True)
    finally:
        addon_rfgs.unregister()


def _fill(scene: bpy.types.Scene) -> None:
    scene.name = "living_room_walk"
    set_render(scene, FRAMES, FPS)
    folders = {name: _collection(name) for name in ("Room", "Furniture", "Person", "Stage")}
    build_room(folders["Room"])
    build_furniture(folders["Furniture"])
    body = dress(load_body())
    person = build_character("person", body, folders["Person"])
    gait, legs = Gait(), legs_of(body)
    times = START_S + np.arange(FRAMES) / FPS
    poses = [walking_pose(gait, body, legs, PATH, float(time_s)) for time_s in times]
    key_walk(person, poses, 1, "walk")
    half_x, half_y = SIZE_M[0] / 2 - 0.2, SIZE_M[1] / 2 - 0.2
    corners = [(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)]
    heights = (1.2, 2.2, 1.2, 2.2)
    places = [(x, y, z) for (x, y), z in zip(corners, heights, strict=True)]
    add_access_points(places, (0.0, 0.0), folders["Stage"])
    cameras = add_cameras(CAMERAS, swept_points(scene, person.children[0]), folders["Stage"])
    add_lights(folders["Stage"])
    show_first_camera(scene, cameras[0])
    scene.frame_set(1)


def swept_points(scene: bpy.types.Scene, skinned: bpy.types.Object) -> np.ndarray:
    """Every tenth vertex of the person over all frames [m], shape (N, 3)."""
    points = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        evaluated = skinned.evaluated_get(bpy.context.evaluated_depsgraph_get())
        flat = np.zeros(3 * len(evaluated.data.vertices), dtype=np.float32)
        evaluated.data.vertices.foreach_get("co", flat)
        world = np.array(evaluated.matrix_world)
        points.append(flat.reshape(-1, 3)[::10] @ world[:3, :3].T + world[:3, 3])
    return np.concatenate(points).astype(np.float64)


def _collection(name: str) -> bpy.types.Collection:
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    return made
