# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds bedroom_fall: an old man walks past his bed, falls and stays lying."""

from __future__ import annotations

import math

import bpy

from blender_scenes.assemble import Folders, set_up
from blender_scenes.motion.falling import Fall
from blender_scenes.motion.going import Stay, Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets import bedroom
from blender_scenes.sets.decoration import picture, plant
from blender_scenes.sets.lighting import WARM, bulb, soft_light
from blender_scenes.sets.room import Room, put
from blender_scenes.sets.shell import Shell, Wall, door, window


def _furnish(to: bpy.types.Collection) -> None:
    put(to, bedroom.bed("bed"), -1.1, -0.72)
    put(to, bedroom.nightstand("nightstand"), -0.02, -1.66)
    put(to, bedroom.wardrobe("wardrobe"), -0.2, 1.56, 180)
    put(to, bedroom.dresser("dresser"), 1.98, 0.75, 90)
    put(to, picture("picture", (0.7, 0.5), "paint_sand"), -1.1, -1.986, 0, 1.65)
    put(to, plant(), 1.95, -0.45)


def _light(to: bpy.types.Collection) -> None:
    soft_light("ceiling", (0.2, 0.0, 2.52), (1.4, 1.4), 30.0, WARM, to)
    bulb("bedside_bulb", (0.08, -1.71, 0.78), 7.0, (1.0, 0.72, 0.42), to)
    soft_light(
        "moon", (2.22, -0.7, 1.55), (1.2, 1.1), 18.0, (0.62, 0.74, 1.0), to, towards=(-1, 0, 0)
    )


ROOM = Room(
    Shell(
        (4.6, 4.0, 2.6),
        south=Wall("wall_rose"),
        north=Wall("wall_paint"),
        east=Wall("wall_outer", (window((-1.4, 0.0), (0.9, 2.1)),)),
        west=Wall("wall_paint", (door((0.8, 1.65)),)),
    ),
    _furnish,
    _light,
)


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    ROOM.build(folders)
    georg = cast(PEOPLE["georg"], folders["Person"])
    pieces = [Walk([(0.85, 0.2)], 0.6, open_start=True), Stay(0.4), Fall("front"), Stay(3.0)]
    perform(georg, pieces, Posture((0.85, 1.0), -math.pi / 2), scene)
    set_up(scene, folders, ROOM.shell.half_m, [georg.armature])
