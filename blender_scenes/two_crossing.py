# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds two_crossing: two people cross a hall, one behind the other at the crossing."""

from __future__ import annotations

import math

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.going import Stay, Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import hall
from blender_scenes.sets.decoration import picture
from blender_scenes.sets.lighting import COOL, NEUTRAL, ceiling_row, soft_light, sun
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door, window


def _furnish(to: bpy.types.Collection) -> None:
    put(to, hall.bench("bench_1"), -1.7, -2.22)
    put(to, hall.bench("bench_2"), 1.7, 2.22, 180)
    put(to, hall.planter("planter_1", 1.2), 0.35, -2.2)
    put(to, hall.planter("planter_2", 1.2), -0.6, 2.2, 180)
    put(to, hall.notice_board("notice_board", 1.8), 1.9, -2.484, 0, 1.1)
    put(to, hall.extinguisher("extinguisher"), 3.13, -1.2, 90, 0.85)
    for index, (x, paint) in enumerate(((-2.2, "paint_rust"), (-1.4, "paint_sand"))):
        put(to, picture(f"picture_{index}", (0.5, 0.7), paint), x, -2.486, 0, 1.6)


def _light(to: bpy.types.Collection) -> None:
    sun((0.55, -0.6, -0.75), 4.5, (1.0, 0.92, 0.80), to)
    ceiling_row([(-1.7, 0.0, 2.7), (1.7, 0.0, 2.7)], (1.8, 1.8), 34.0, NEUTRAL, to)
    soft_light("window_glow", (0.0, 2.42, 1.6), (3.0, 1.2), 28.0, COOL, to, towards=(0, -1, 0))


ROOM = Room(
    Shell(
        (6.4, 5.0, 2.8),
        south=Wall("wall_sage"),
        north=Wall(
            "wall_outer", (window((-2.4, -0.9), (0.9, 2.3)), window((0.9, 2.4), (0.9, 2.3)))
        ),
        east=Wall("wall_paint", (door((0.2, 1.1)),)),
        west=Wall("wall_paint", (door((-1.1, -0.2)),)),
        floor="terrazzo",
    ),
    _furnish,
    _light,
)


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    david, emma = (cast(PEOPLE[name], folders["Person"]) for name in ("david", "emma"))
    walk = Walk([(2.35, 1.05)], 0.85, open_start=True)
    perform(david, [walk], Posture((-2.3, -1.1), math.atan2(2.15, 4.65)), scene)
    later = [Stay(1.3), Walk([(2.3, -1.1)], 1.15)]
    perform(emma, later, Posture((-2.3, 1.2), -math.atan2(2.3, 4.6)), scene)
    set_up(scene, folders, ROOM.shell.half_m, [david.armature, emma.armature])
