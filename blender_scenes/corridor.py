# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds corridor: a person walks the length of a narrow corridor."""

from __future__ import annotations

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.going import Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import hall
from blender_scenes.sets.decoration import picture
from blender_scenes.sets.lighting import COOL, NEUTRAL, ceiling_row, soft_light
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door, window


def _furnish(to: bpy.types.Collection) -> None:
    put(to, hall.lockers("lockers_1", 4), -2.35, -0.86)
    put(to, hall.bench("bench"), 0.9, 0.86, 180)
    put(to, hall.notice_board("notice_board"), 0.9, 1.084, 180, 1.15)
    put(to, hall.extinguisher("extinguisher"), -0.95, -1.0, 0, 0.85)
    put(to, hall.planter("planter"), 2.0, -0.88)
    put(to, hall.exit_sign("exit_sign"), 4.27, 0.0, 90, 2.32)
    for index, x in enumerate((-1.3, 0.5)):
        frame = picture(f"picture_{index}", (0.5, 0.4), ("paint_teal", "paint_rust")[index])
        put(to, frame, x if index else -3.3, -1.086 if index else 1.086, 0 if index else 180, 1.6)


def _light(to: bpy.types.Collection) -> None:
    ceiling_row([(x, 0.0, 2.55) for x in (-3.2, -1.07, 1.07, 3.2)], (1.2, 0.25), 15.0, NEUTRAL, to)
    soft_light("window_glow", (-4.22, 0.0, 1.5), (0.9, 1.1), 22.0, COOL, to, towards=(1, 0, -0.1))


ROOM = Room(
    Shell(
        (8.6, 2.2, 2.6),
        south=Wall(
            "wall_paint", (door((1.0, 1.9), leaf="paint_teal"), door((3.0, 3.9))), "wall_blue", 1.1
        ),
        north=Wall(
            "wall_paint",
            (door((-2.6, -1.7)), door((2.2, 3.1), leaf="paint_teal")),
            "wall_blue",
            1.1,
        ),
        east=Wall("wall_outer", (door((-0.5, 0.5), height_m=2.1, leaf="door_wood"),)),
        west=Wall("wall_outer", (window((-0.6, 0.6), (0.9, 2.1), panes=1),)),
        floor="linoleum",
    ),
    _furnish,
    _light,
)

#: At both ends: from the south-west, lockers would hide the person.
CAMERAS = (
    (-4.1, 0.9, 2.35), (4.1, 0.9, 2.35), (4.1, -0.9, 1.6), (-4.1, 0.6, 1.6), (-4.1, 0.2, 2.2),
    (4.1, 0.0, 1.9), (-4.1, 0.9, 1.4), (4.1, 0.9, 1.5), (4.1, -0.9, 2.35), (-4.1, 0.6, 2.4),
    (-4.1, 0.3, 1.3), (4.1, -0.4, 1.3),
)  # fmt: skip


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    anna = cast(PEOPLE["anna"], folders["Person"])
    walk = Walk([(-0.2, -0.08), (3.4, 0.12)], 1.05, open_start=True, open_end=True)
    perform(anna, [walk], Posture((-3.3, 0.15), 0.0), scene)
    set_up(scene, folders, ROOM.shell.half_m, [anna.armature], CAMERAS)
