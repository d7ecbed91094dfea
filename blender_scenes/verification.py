# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds small scenes of plain shapes from a description: what physics has closed forms for.

`python -m blender_scenes shapes DESCRIPTION --out FILE`, where DESCRIPTION is a JSON file:

    {"frames": 3, "fps": 10,
     "parts": [{"name": "wall", "shape": "sheet", "size": [4, 3, 0], "cells": 1, "at": [0, 0, 1],
                "turn_deg": [0, 0, 90], "material": "concrete", "thickness_m": 0.2,
                "class": "STATIC", "keys": [[1, [0, 0, 1], 0], [3, [1, 0, 1], 45]]}],
     "devices": [{"name": "a", "at": [0, 0, 1], "yaw_deg": 0, "role": "ACCESS_POINT",
                  "radio": "any"}],
     "cameras": [{"name": "cam_00", "at": [2, 2, 1], "to": [0, 0, 1], "angle_deg": 60}]}

`keys` are (frame, place [m], angle about z [deg]); in between, parts move evenly.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import bpy

# isort: split
# There is no bmesh before bpy.
import bmesh
from mathutils import Matrix, Vector

from blender_scenes.assemble import Folders, save_scene

#: Display colours by radio material, so that pictures tell parts apart; linear RGB.
_COLOURS = {
    "concrete": (0.5, 0.5, 0.48),
    "plasterboard": (0.8, 0.78, 0.7),
    "wood": (0.45, 0.25, 0.12),
    "glass": (0.4, 0.65, 0.7),
    "metal": (0.55, 0.57, 0.6),
    "skin": (0.8, 0.45, 0.35),
}


def build(description: dict[str, Any], out: Path) -> None:
    """Builds a scene of a description, see above, and saves it as `out`."""

    def fill(scene: bpy.types.Scene, folders: Folders) -> None:
        for part in description["parts"]:
            folder = "Room" if part["class"] == "STATIC" else "Person"
            folders[folder].objects.link(_part(part))
        for device in description["devices"]:
            folders["Stage"].objects.link(_device(device))
        for camera in description["cameras"]:
            folders["Stage"].objects.link(_camera(camera))
        lamp = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
        lamp.rotation_euler = (0.6, 0.3, 0.0)
        folders["Stage"].objects.link(lamp)

    save_scene(out, out.stem, description["frames"], description["fps"], fill)


def _part(part: dict[str, Any]) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(part["name"])
    shape = bmesh.new()
    {"sheet": _sheet, "box": _box, "ball": _ball}[part["shape"]](shape, part)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(_material(part["material"], part["thickness_m"]))
    item = bpy.data.objects.new(part["name"], mesh)
    item.rfgs.object_class = part["class"]
    item.location = part["at"]
    item.rotation_euler = [math.radians(angle) for angle in part["turn_deg"]]
    for frame, place, yaw_deg in part["keys"]:
        item.location = place
        item.rotation_euler.z = math.radians(part["turn_deg"][2] + yaw_deg)
        item.keyframe_insert("location", frame=frame)
        item.keyframe_insert("rotation_euler", frame=frame)
    if part["keys"]:
        for curve in item.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    return item


def _sheet(shape: bmesh.types.BMesh, part: dict[str, Any]) -> None:
    """A rectangle across z, its normal up."""
    _grid(shape, part, Matrix.Identity(4))


def _grid(shape: bmesh.types.BMesh, part: dict[str, Any], turn: Matrix) -> None:
    """`cells` by `cells` quads over the unit square of a turned box, sized afterwards."""
    cells, size = part["cells"], Matrix.Diagonal((*part["size"], 1.0))
    grid = [
        [shape.verts.new(size @ turn @ Vector((i / cells - 0.5, j / cells - 0.5, 0.0)))
         for j in range(cells + 1)]
        for i in range(cells + 1)
    ]  # fmt: skip
    for i in range(cells):
        for j in range(cells):
            shape.faces.new((grid[i][j], grid[i + 1][j], grid[i + 1][j + 1], grid[i][j + 1]))


def _box(shape: bmesh.types.BMesh, part: dict[str, Any]) -> None:
    """A closed box, each face of `cells` by `cells` quads, normals outwards."""
    quarter = math.pi / 2
    turns = [Matrix.Rotation(k * quarter, 4, "X") for k in range(4)]
    turns += [Matrix.Rotation(sign * quarter, 4, "Y") for sign in (-1, 1)]
    for turn in turns:
        _grid(shape, part, turn @ Matrix.Translation((0.0, 0.0, 0.5)))
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=1e-5)


def _ball(shape: bmesh.types.BMesh, part: dict[str, Any]) -> None:
    """A sphere of triangles of even size; its diameter is `size`, `cells` its subdivisions."""
    scale = Matrix.Diagonal((*(0.5 * length for length in part["size"]), 1.0))
    bmesh.ops.create_icosphere(shape, subdivisions=part["cells"], radius=1.0, matrix=scale)


def _material(kind: str, thickness_m: float) -> bpy.types.Material:
    name = f"{kind} {thickness_m * 1e3:g} mm"
    made = bpy.data.materials.get(name)
    if made is None:
        made = bpy.data.materials.new(name)
        made.use_nodes = True
        shader = made.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (*_COLOURS.get(kind, (0.6, 0.6, 0.6)), 1.0)
        made.rfgs.radio_material, made.rfgs.thickness_m = kind, thickness_m
    return made


def _device(device: dict[str, Any]) -> bpy.types.Object:
    item = bpy.data.objects.new(device["name"], None)
    item.location = device["at"]
    item.rotation_euler = (0.0, 0.0, math.radians(device["yaw_deg"]))
    item.rfgs.role, item.rfgs.radio = device["role"], device["radio"]
    return item


def _camera(camera: dict[str, Any]) -> bpy.types.Object:
    data = bpy.data.cameras.new(camera["name"])
    data.angle, data.clip_start, data.clip_end = math.radians(camera["angle_deg"]), 0.02, 50.0
    item = bpy.data.objects.new(camera["name"], data)
    item.location = camera["at"]
    way = Vector(camera["to"]) - Vector(camera["at"])
    item.rotation_euler = way.to_track_quat("-Z", "Y").to_euler()
    return item
