# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds crowd_of_four: four people pass each other in a lobby."""

from __future__ import annotations

import math

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.going import Stay, Turn, Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import hall
from blender_scenes.sets.decoration import picture
from blender_scenes.sets.lighting import COOL, WARM, ceiling_row, soft_light
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.seating import armchair
from blender_scenes.sets.shell import Shell, Wall, door, window


def _furnish(to: bpy.types.Collection) -> None:
    put(to, armchair(), -2.55, 2.05, 225)
    put(to, hall.bench("bench_1", 1.8), 1.4, 2.6, 180)
    put(to, hall.planter("planter_1", 1.0), -0.7, 2.62, 180)
    put(to, hall.planter("planter_2", 1.0), 0.4, -2.62)
    put(to, hall.bench("bench_2", 1.6), -1.9, -2.6)
    put(to, hall.notice_board("notice_board"), 2.0, -2.884, 0, 1.15)
    put(to, hall.exit_sign("exit_sign"), 3.27, 0.6, 90, 2.5)
    put(to, picture("picture", (0.9, 0.6), "paint_teal"), 1.4, 2.886, 180, 1.65)


def _light(to: bpy.types.Collection) -> None:
    ceiling_row(
        [(x, y, 2.72) for x in (-1.7, 1.7) for y in (-1.4, 1.4)], (1.0, 1.0), 23.0, WARM, to
    )
    soft_light("window_glow", (-3.22, 0.0, 1.6), (3.0, 1.4), 45.0, COOL, to, towards=(1, 0, -0.05))


ROOM = Room(
    Shell(
        (6.6, 5.8, 2.8),
        south=Wall("wall_paint"),
        north=Wall("wall_accent"),
        east=Wall("wall_paint", (door((0.1, 1.1)),)),
        west=Wall("wall_outer", (window((-1.8, 1.8), (0.6, 2.3), panes=4),)),
        floor="terrazzo",
    ),
    _furnish,
    _light,
)


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    to = folders["Person"]
    parts = {
        "felix": (Posture((2.3, 0.2), math.pi), [Walk([(0.7, 0.25)], 0.8), Turn(90), Stay(3.0)]),
        "georg": (Posture((2.2, 1.6), math.pi), [Walk([(-0.2, 1.45), (-2.0, 0.9)], 0.75)]),
        "hana": (Posture((-2.2, -1.5), 0.0), [Walk([(0.4, -1.35), (2.3, -1.0)], 0.95), Stay(2.0)]),
        "ivan": (
            Posture((-2.3, 0.0), 0.0),
            [Walk([(-0.7, -0.1)], 1.0), Stay(1.2), Turn(-90), Stay(2.5)],
        ),
    }
    crowd = []
    for name, (start, pieces) in parts.items():
        crowd.append(cast(PEOPLE[name], to))
        perform(crowd[-1], pieces, start, scene)
    set_up(scene, folders, ROOM.shell.half_m, [actor.armature for actor in crowd])
