# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds through_wall: two people walk behind a concrete wall, the radios are before it."""

from __future__ import annotations

import math

import bpy

from blender_scenes.assemble import Folders, watch
from blender_scenes.motion.going import Stay, Turn, Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import hall, workplace
from blender_scenes.sets.decoration import picture
from blender_scenes.sets.lighting import COOL, WARM, ceiling_row, soft_light
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, build_partition, door, window
from blender_scenes.stage import add_access_points, around_room, corners


def _furnish(to: bpy.types.Collection) -> None:
    put(to, workplace.desk("desk", 1.3, 0.65), -3.0, -1.5)
    put(to, workplace.screen("screen"), -3.0, -1.62, 0, 0.752)
    put(to, workplace.office_chair("chair"), -2.8, -0.75, 200)
    put(to, workplace.shelf_rack("rack"), -2.2, 1.72, 180)
    put(to, hall.bench("bench"), 2.4, 1.72, 180)
    put(to, hall.planter("planter_2", 1.1), 3.1, -1.75)
    put(to, hall.planter("planter_1"), 1.0, -1.75)
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

WALL_X_M = 0.0


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    build_partition(ROOM.shell, "wall_between", Wall("bare_concrete"), WALL_X_M, folders["Room"])
    ben, clara = (cast(PEOPLE[name], folders["Person"]) for name in ("ben", "clara"))
    there_and_back = [Walk([(3.2, 0.55)], 1.05), Turn(180), Walk([(0.9, 0.75)], 1.05)]
    perform(ben, there_and_back, Posture((0.9, 0.75), 0.0), scene)
    slowly = [Stay(0.6), Walk([(1.0, -0.65)], 0.8), Turn(-180), Walk([(3.1, -0.6)], 0.8)]
    perform(clara, slowly, Posture((3.1, -0.6), math.pi), scene)
    half_x, half_y = ROOM.shell.half_m
    # All radios are west of the wall, all cameras east of it.
    west = [(x + (WALL_X_M - half_x) / 2, y, z) for x, y, z in corners((half_x / 2, half_y))]
    add_access_points(west, (WALL_X_M - half_x / 2, 0.0), folders["Stage"])
    east = [(x + half_x / 2, y, z) for x, y, z in around_room((half_x / 2, half_y))]
    watch(scene, east, [ben.armature, clara.armature], folders["Stage"])
