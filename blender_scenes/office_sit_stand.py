# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds office_sit_stand: a person sits down at a desk, works and stands up again."""

from __future__ import annotations

import math

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.going import Stay
from blender_scenes.motion.seat import Rise, Sit, before_seat
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import workplace
from blender_scenes.sets.decoration import ceiling_light, plant
from blender_scenes.sets.lighting import COOL, NEUTRAL, ceiling_row, soft_light, sun
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door, window

#: Above the seat of the chair by more than a centimetre, so that the ray tracer keeps both.
SEAT_M = 0.475
CHAIR_M = (0.35, -0.20)


def _furnish(to: bpy.types.Collection) -> None:
    put(to, workplace.desk("desk_1", 1.6), 0.35, -1.30)
    put(to, workplace.screen("screen_1"), 0.35, -1.47, 0, 0.752)
    put(to, workplace.office_chair("chair_1"), *CHAIR_M, 180)
    put(to, workplace.desk("desk_2", 1.4), -1.55, 1.42, 180)
    put(to, workplace.screen("screen_2"), -1.55, 1.58, 180, 0.752)
    put(to, workplace.office_chair("chair_2"), -1.4, 0.72, 20)
    put(to, workplace.filing_cabinet("cabinet_1"), 1.25, 1.66, 180)
    put(to, workplace.filing_cabinet("cabinet_2", 3), 0.72, 1.66, 180)
    put(to, workplace.whiteboard("whiteboard"), -2.484, -0.2, -90, 1.0)
    put(to, workplace.bin_("bin"), -0.75, -1.55)
    put(to, plant(), 2.05, -1.55)
    put(to, ceiling_light(), 0.0, 0.0)


def _light(to: bpy.types.Collection) -> None:
    sun((-0.75, 0.30, -0.62), 4.0, (1.0, 0.95, 0.86), to)
    ceiling_row([(-1.2, 0.0, 2.6), (1.2, 0.0, 2.6)], (1.2, 0.6), 32.0, NEUTRAL, to)
    soft_light("window_glow", (2.42, 0.2, 1.5), (2.2, 1.2), 36.0, COOL, to, towards=(-1, 0, 0))


ROOM = Room(
    Shell(
        (5.0, 4.0, 2.7),
        south=Wall("wall_sage"),
        north=Wall("wall_paint"),
        east=Wall("wall_outer", (window((-1.0, 1.4), (0.9, 2.2), panes=3),)),
        west=Wall("wall_grey", (door((0.7, 1.6)),)),
        floor="carpet_grey",
    ),
    _furnish,
    _light,
)


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    david = cast(PEOPLE["david"], folders["Person"])
    start = before_seat(david.figure, CHAIR_M, -math.pi / 2, SEAT_M)
    again = [Stay(0.5), Sit(SEAT_M), Stay(2.2), Rise(SEAT_M), Stay(0.9), Sit(SEAT_M), Stay(2.0)]
    perform(david, again, start, scene)
    set_up(scene, folders, ROOM.shell.half_m, [david.armature])
