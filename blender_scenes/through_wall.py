# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds through_wall."""

from __future__ import annotations

import bpy

from blender_scenes.sets import hall, workplace
from blender_scenes.sets.decoration import picture
from blender_scenes.sets.lighting import COOL, WARM, ceiling_row, soft_light
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door, window


def _furnish(to: bpy.types.Collection) -> None:
    put(to, workplace.desk("desk", 1.3, 0.65), -3.0, -1.5)
    put(to, workplace.screen("screen"), -3.0, -1.62, 0, 0.752)
    put(to, workplace.office_chair("chair"), -2.8, -0.75, 200)
    put(to, workplace.shelf_rack("rack"), -2.2, 1.72, 180)
    put(to, hall.bench("bench"), 2.4, 1.72, 180)
    put(to, hall.lockers("lockers", 3), 3.0, -1.72)
    put(to, hall.planter("planter"), 1.0, -1.75)
    put(to, picture("picture", (0.6, 0.45), "paint_sand"), 2.4, 1.984, 180, 1.6)


def _light(to: bpy.types.Collection) -> None:
    ceiling_row([(-2.6, 0.0, 2.6), (-1.2, 0.0, 2.6)], (0.6, 1.2), 30.0, COOL, to)
    lamps = [(1.3, 0.0, 2.6), (2.9, 0.0, 2.6)]
    for index, place in enumerate(lamps):
        soft_light(f"east_light_{index}", place, (0.6, 1.2), 42.0, WARM, to)


ROOM = Room(
    Shell(
        (8.0, 4.0, 2.7),
        south=Wall("wall_paint", (door((1.6, 2.5)),)),
        north=Wall("wall_paint", (door((-3.6, -2.9), leaf="paint_teal"),)),
        east=Wall("wall_rose", (window((-0.8, 0.8), (0.9, 2.1)),)),
        west=Wall("wall_grey"),
        floor="screed",
    ),
    _furnish,
    _light,
)
