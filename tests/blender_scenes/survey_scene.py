# SPDX-License-Identifier: Apache-2.0
"""Measures a .blend with Blender and writes what it found as arrays and JSON.

Runs in a Python of its own, as one process holds one Blender scene.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

import addon_rfgs

JOINT_BONES = [
    *("root", "spine01", "neck01", "head"),
    *(f"{bone}.{side}" for side in "LR" for bone in ("upperarm01", "lowerarm01", "wrist")),
    *(f"{bone}.{side}" for side in "LR" for bone in ("upperleg01", "lowerleg01", "foot", "toe1-1")),
]


def world_vertices(item: bpy.types.Object) -> np.ndarray:
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    flat = np.zeros(3 * len(evaluated.data.vertices), dtype=np.float32)
    evaluated.data.vertices.foreach_get("co", flat)
    matrix = np.array(evaluated.matrix_world)
    return flat.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def polygons(item: bpy.types.Object) -> list[list[int]]:
    return [list(polygon.vertices) for polygon in item.data.polygons]


def describe(item: bpy.types.Object) -> dict:
    vertices = world_vertices(item)
    item.data.calc_loop_triangles()
    return {
        "collection": item.users_collection[0].name,
        "low": vertices.min(axis=0).tolist(),
        "high": vertices.max(axis=0).tolist(),
        "triangles": len(item.data.loop_triangles),
        "class": item.rfgs.object_class,
        "planes": [
            [*item.matrix_world.to_3x3() @ p.normal, *item.matrix_world @ p.center]
            for p in item.data.polygons
        ]
        if item.users_collection[0].name == "Room"
        else [],
    }


def static_tree(items: list[bpy.types.Object]) -> BVHTree:
    vertices: list = []
    faces: list = []
    for item in items:
        start = len(vertices)
        vertices += world_vertices(item).tolist()
        faces += [[start + index for index in face] for face in polygons(item)]
    return BVHTree.FromPolygons(vertices, faces)


def visible(tree: BVHTree, eye: Vector, point: Vector) -> bool:
    reach = point - eye
    return tree.ray_cast(eye, reach.normalized(), reach.length - 0.02)[0] is None


def main(blend: str, out: str) -> None:
    addon_rfgs.register()
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    armature = next(item for item in bpy.data.objects if item.type == "ARMATURE")
    skinned = armature.children[0]
    static = [i for i in bpy.data.objects if i.type == "MESH" and i is not skinned]
    tree = static_tree(static)
    cameras = sorted((i for i in bpy.data.objects if i.type == "CAMERA"), key=lambda i: i.name)
    frames = range(scene.frame_start, scene.frame_end + 1)
    vertices, joints, seen = [], [], []
    for frame in frames:
        scene.frame_set(frame)
        vertices.append(world_vertices(skinned))
        heads = [armature.matrix_world @ armature.pose.bones[name].head for name in JOINT_BONES]
        joints.append([point[:] for point in heads])
        seen.append(
            [[visible(tree, eye.matrix_world.translation, p) for p in heads] for eye in cameras]
        )
    groups = {group.index: group.name for group in skinned.vertex_groups}
    main_bone = [groups[max(v.groups, key=lambda g: g.weight).group] for v in skinned.data.vertices]
    np.savez(
        Path(out) / "person.npz",
        vertices=np.array(vertices),
        joints=np.array(joints),
        seen=np.array(seen),
        faces=np.array(polygons(skinned)),
        bone=np.array(main_bone),
        cameras=np.array([eye.matrix_world for eye in cameras]),
        angles=np.array([eye.data.angle for eye in cameras]),
    )
    devices = [i for i in bpy.data.objects if i.type == "EMPTY" and i.rfgs.role != "NONE"]
    report = {
        "objects": {item.name: describe(item) for item in static},
        "person": {"name": skinned.name, "class": skinned.rfgs.object_class},
        "action": armature.animation_data.action.name,
        "cameras": [eye.name for eye in cameras],
        "devices": {
            d.name: {
                "role": d.rfgs.role,
                "radio": d.rfgs.radio,
                "position": d.matrix_world.translation[:],
                "boresight": d.matrix_world.to_3x3().col[0][:],
                "up": d.matrix_world.to_3x3().col[2][:],
            }
            for d in devices
        },
        "materials": {
            m.name: [m.rfgs.radio_material, m.rfgs.thickness_m] for m in bpy.data.materials
        },
        "frames": [scene.frame_start, scene.frame_end, scene.render.fps],
        "view_transform": scene.view_settings.view_transform,
        "engine": scene.render.engine,
    }
    (Path(out) / "scene.json").write_text(json.dumps(report))
    addon_rfgs.unregister()


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stdout.flush()
    # Python's own end may wait for ever on Blender's threads.
    os._exit(0)
