# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds living_room_walk: a furnished room and a person who walks through it."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np

from blender_scenes.assemble import Folders, save_scene, watch
from blender_scenes.body import load_body
from blender_scenes.character import build_character
from blender_scenes.clothes import dress
from blender_scenes.gait import Gait
from blender_scenes.sets.decoration import light_room
from blender_scenes.sets.furniture import build_furniture
from blender_scenes.sets.living_room import SHELL, build_room
from blender_scenes.stage import add_access_points, corners
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
    save_scene(out, "living_room_walk", FRAMES, FPS, _fill)


def _fill(scene: bpy.types.Scene, folders: Folders) -> None:
    build_room(folders["Room"])
    build_furniture(folders["Furniture"])
    body = dress(load_body())
    person = build_character("person", body, folders["Person"])
    gait, legs = Gait(), legs_of(body)
    times = START_S + np.arange(FRAMES) / FPS
    poses = [walking_pose(gait, body, legs, PATH, float(time_s)) for time_s in times]
    key_walk(person, poses, 1, "walk")
    add_access_points(corners(SHELL.half_m), (0.0, 0.0), folders["Stage"])
    watch(scene, CAMERAS, [person], folders["Stage"])
    light_room(folders["Stage"])
