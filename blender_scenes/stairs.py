# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds stairs: a person walks up to three steps and climbs them to a landing."""

from __future__ import annotations

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.going import Walk
from blender_scenes.motion.score import Posture
from blender_scenes.motion.stairs import Climb
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import hall
from blender_scenes.sets.decoration import picture
from blender_scenes.sets.lighting import COOL, NEUTRAL, ceiling_row, soft_light, sun
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door, window

#: Steps of `STAIRWAY`: how many, rise [m], run [m], y of the first edge [m].
STEPS, RISE_M, RUN_M, FIRST_STEP_X_M = 3, 0.17, 0.30, 0.35


def _furnish(to: bpy.types.Collection) -> None:
    put(to, hall.stairs("stairs", STEPS - 1, RISE_M, RUN_M, 1.6), FIRST_STEP_X_M, 0.0, -90)
    edge = FIRST_STEP_X_M + (STEPS - 1) * RUN_M + 0.012
    depth = 3.0 - 0.02 - edge
    put(to, hall.landing("landing", (3.6, depth, STEPS * RISE_M)), edge, 0.0, -90)
    for side in (-0.86, 0.86):
        rail = hall.railing(f"railing_{'ns'[side < 0]}", STEPS * RUN_M, RISE_M / RUN_M)
        put(to, rail, FIRST_STEP_X_M + 0.02, side, -90, 0.02)
    put(to, hall.bench("bench"), -1.6, 1.68, 180)
    put(to, hall.planter("planter"), -1.4, -1.70)
    put(to, picture("picture", (0.8, 0.6), "paint_rust"), -1.6, 1.986, 180, 1.65)
    put(to, hall.extinguisher("extinguisher"), -0.1, -1.88, 0, 0.85)


def _light(to: bpy.types.Collection) -> None:
    sun((-0.70, 0.10, -0.62), 4.5, (1.0, 0.90, 0.75), to)
    ceiling_row([(-1.6, 0.0, 2.9), (1.4, 0.0, 2.9)], (1.0, 1.6), 26.0, NEUTRAL, to)
    soft_light("window_glow", (2.92, 0.0, 1.9), (2.2, 1.3), 24.0, COOL, to, towards=(-1, 0, 0))


ROOM = Room(
    Shell(
        (6.0, 4.0, 3.0),
        south=Wall("wall_paint"),
        north=Wall("wall_sage"),
        east=Wall("wall_outer", (window((-1.2, 1.2), (1.25, 2.6), panes=3),)),
        west=Wall("wall_paint", (door((-0.45, 0.45)),)),
        floor="terrazzo",
    ),
    _furnish,
    _light,
)

TO_FIRST_M = 0.32


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    hana = cast(PEOPLE["hana"], folders["Person"])
    pieces = [
        Walk([(FIRST_STEP_X_M - TO_FIRST_M, 0.0)], 0.95, open_start=True),
        Climb(STEPS, RISE_M, RUN_M, TO_FIRST_M),
        Walk([(2.1, -0.2)], 0.8),
    ]
    perform(hana, pieces, Posture((-2.3, 0.0), 0.0), scene)
    set_up(scene, folders, ROOM.shell.half_m, [hana.armature])
