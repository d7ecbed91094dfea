# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds crowd_of_four."""

from __future__ import annotations

import bpy

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
    put(to, hall.lockers("lockers", 4), -1.9, -2.6)
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
