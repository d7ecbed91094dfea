# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds gestures: a person in a laboratory makes the six gestures of the Widar data."""

from __future__ import annotations

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.gestures import Gesture
from blender_scenes.motion.going import Stay
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import workplace
from blender_scenes.sets.lighting import COOL, ceiling_row
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door


def _furnish(to: bpy.types.Collection) -> None:
    put(to, workplace.shelf_rack("rack_1"), -1.2, 1.95, 180)
    put(to, workplace.shelf_rack("rack_2"), 0.15, 1.95, 180)
    put(to, workplace.desk("bench_1", 1.6, 0.7), 1.25, -1.80)
    put(to, workplace.screen("screen_1"), 0.95, -1.92, 0, 0.752)
    put(to, workplace.filing_cabinet("cabinet", 2), -1.5, -1.85)
    put(to, workplace.whiteboard("whiteboard", 1.6), 2.484, 0.3, 90, 1.0)
    put(to, workplace.office_chair("chair"), 1.9, -1.05, 150)
    put(to, workplace.bin_("bin"), -0.85, -1.95)


def _light(to: bpy.types.Collection) -> None:
    ceiling_row(
        [(x, y, 2.62) for x in (-1.25, 1.25) for y in (-1.1, 1.1)], (1.2, 0.3), 26.0, COOL, to
    )


ROOM = Room(
    Shell(
        (5.0, 4.5, 2.7),
        south=Wall("wall_paint"),
        north=Wall("wall_grey"),
        east=Wall("wall_blue"),
        west=Wall("wall_paint", (door((-0.5, 0.5), leaf="paint_teal"),)),
        floor="linoleum",
    ),
    _furnish,
    _light,
)

KINDS = ("push_pull", "sweep", "clap", "slide", "draw_o", "draw_zigzag")


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    emma = cast(PEOPLE["emma"], folders["Person"])
    pieces = [piece for kind in KINDS for piece in (Gesture(kind), Stay(0.3))]
    perform(emma, pieces, Posture((0.0, 0.0), 0.0), scene)
    set_up(scene, folders, ROOM.shell.half_m, [emma.armature])
