# SPDX-License-Identifier: GPL-3.0-or-later
"""A bare floor with two people who do a few things; saved as the .blend named in the call."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import bpy

from blender_scenes.assemble import Folders, save_scene
from blender_scenes.motion.gestures import Gesture
from blender_scenes.motion.going import Stay, Turn, Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.surfaces import material


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    floor = bpy.data.meshes.new("floor")
    floor.from_pydata([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [], [(0, 1, 2, 3)])
    floor.materials.append(material("oak_floor"))
    folders["Room"].objects.link(bpy.data.objects.new("floor", floor))
    anna, felix = (cast(PEOPLE[name], folders["Person"]) for name in ("anna", "felix"))
    perform(anna, [Stay(6.0)], Posture((-1.0, 0.0), -1.5), scene)
    pieces = [Gesture("clap"), Turn(60), Walk([(1.3, 1.6)], 0.9, open_end=True)]
    perform(felix, pieces, Posture((1.0, -0.6), 0.4), scene)
    eye = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    eye.location = (0.0, -5.0, 1.5)
    eye.rotation_euler = (1.45, 0.0, 0.0)
    folders["Stage"].objects.link(eye)
    scene.camera = eye


if __name__ == "__main__":
    save_scene(Path(sys.argv[1]), "cast", 60, 10, fill)
    sys.stdout.flush()
    # Python's own end may wait for ever on Blender's threads.
    os._exit(0)
