# SPDX-License-Identifier: Apache-2.0
"""Saves a small Blender file: a box that walks through an empty concrete room.

Runs in a Python of its own, as one process holds one Blender scene.
"""

from __future__ import annotations

import os
import sys

import bpy

import addon_rfgs


def material(name: str, kind: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*colour, 1.0)
    made.rfgs.radio_material = kind
    return made


def mesh(name: str, vertices: list, faces: list, made: bpy.types.Material) -> bpy.types.Object:
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    data.materials.append(made)
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    return item


def room(wall: bpy.types.Material) -> None:
    x, y, z = 3.0, 3.0, 2.5
    corners = [(i * x, j * y, k * z) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    mesh("Floor", [corners[i] for i in (0, 4, 6, 2)], [(0, 1, 2, 3)], wall)
    for index, quad in enumerate([(0, 1, 5, 4), (4, 5, 7, 6), (6, 7, 3, 2), (2, 3, 1, 0)]):
        mesh(f"Wall {index}", [corners[i] for i in quad], [(3, 2, 1, 0)], wall)


def person(skin: bpy.types.Material, moving: bool, scale: float, kind: str) -> None:
    hx, hy, hz = 0.2 * scale, 0.15 * scale, 0.85 * scale
    corners = [(i * hx, j * hy, k * hz) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    item = mesh("Box person", corners, quads, skin)
    item.rfgs.object_class = kind
    item.location = (1.2, 1.5, 0.9 * scale)
    if moving:
        item.keyframe_insert("location", frame=1)
        item.location.x = 1.8
        item.keyframe_insert("location", frame=4)


def main(out: str, moving: str, wall: str, scale: str, kind: str = "PERSON") -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_rfgs.register()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 4, 10
    room(material("Wall paint", wall, (0.7, 0.7, 0.68)))
    person(material("Skin", "skin", (0.8, 0.4, 0.3)), moving == "moving", float(scale), kind)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.location = 100.0, (1.5, 1.5, 2.3)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens, camera.location = 20.0, (1.5, 0.15, 1.5)
    camera.rotation_euler = (1.45, 0.0, 0.0)
    for item in (lamp, camera):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 64
    bpy.ops.wm.save_as_mainfile(filepath=out, compress=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stdout.flush()
    # Leaving the interpreter with registered classes can hang inside bpy.
    os._exit(0)
