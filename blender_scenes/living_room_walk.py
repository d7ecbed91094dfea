# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds living_room_walk: a furnished room and a person who walks through it."""

from __future__ import annotations

import math

import bpy
import numpy as np

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.footsteps import EndlessSteps
from blender_scenes.motion.gait import Gait
from blender_scenes.motion.path import ArcPath
from blender_scenes.motion.skeleton import skeleton_of
from blender_scenes.motion.walking import walking_pose
from blender_scenes.people.action import key_poses
from blender_scenes.people.body import load_body
from blender_scenes.people.character import build_character
from blender_scenes.people.clothes import dress
from blender_scenes.sets.decoration import light_room
from blender_scenes.sets.furniture import build_furniture
from blender_scenes.sets.living_room import SHELL, build_room

#: Through the middle of the room, between the rug and the television, past the dining table.
PATH = ArcPath((0.0, 0.24), math.radians(-3), 4.0, -math.radians(46))
#: The pelvis is at the path's beginning at this time of the gait [s].
START_S = Gait().stance * Gait().step_s
#: High in the corners, at eye height, and along the walls; any first few look from all around.
CAMERAS = (
    (-2.75, -2.25, 2.40), (2.75, 2.25, 2.40), (2.72, -2.28, 1.55), (-2.80, 2.28, 1.60),
    (0.30, 2.36, 1.75), (-0.35, -2.38, 2.20), (-2.70, -2.30, 1.50), (2.75, -2.25, 2.42),
    (2.80, 2.30, 1.78), (-2.75, 2.25, 2.42), (1.10, -2.38, 1.45), (-0.90, 2.36, 2.40),
)  # fmt: skip


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    build_room(folders["Room"])
    build_furniture(folders["Furniture"])
    body = dress(load_body())
    person = build_character("person", body, folders["Person"])
    gait, skeleton = Gait(), skeleton_of(body)
    steps = EndlessSteps(PATH, gait.step_m, gait.stance, gait.width_m, gait.toe_out_rad)
    phases = (START_S + np.arange(scene.frame_end) / scene.render.fps) / gait.step_s
    poses = [walking_pose(gait, skeleton, steps, float(phase)) for phase in phases]
    key_poses(person, poses, ["walk"] * scene.frame_end, first_frame=1, hold=False)
    set_up(scene, folders, SHELL.half_m, [person], CAMERAS)
    light_room(folders["Stage"])
