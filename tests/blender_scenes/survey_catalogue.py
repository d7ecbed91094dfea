# SPDX-License-Identifier: Apache-2.0
"""Measures every scene of the catalogue at a few frames and writes what it found as JSON.

Runs in a Python of its own: `survey_catalogue.py OUT.json BLEND …`.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from survey_scene import world_vertices

import addon_rfgs


def box(points: np.ndarray) -> list[list[float]]:
    return [points.min(axis=0).tolist(), points.max(axis=0).tolist()]


def people() -> list[bpy.types.Object]:
    found = (i for i in bpy.data.objects if i.type == "MESH" and i.rfgs.object_class == "PERSON")
    return sorted(found, key=lambda item: item.name)


def in_view(camera: bpy.types.Object, points: np.ndarray) -> bool:
    eye = np.array(camera.matrix_world)
    local = (points - eye[:3, 3]) @ eye[:3, :3]
    slopes = np.abs(local[:, :2] / local[:, 2:])
    return bool((local[:, 2] < 0).all() and slopes.max() < np.tan(camera.data.angle / 2))


def measure(blend: str) -> dict:
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    bodies = people()
    cameras = [item for item in bpy.data.objects if item.type == "CAMERA"]
    frames = np.linspace(scene.frame_start, scene.frame_end, 7).round().astype(int)
    boxes, seen = [], []
    for frame in frames:
        scene.frame_set(int(frame))
        points = [world_vertices(item) for item in bodies]
        boxes.append([box(p) for p in points])
        seen.append([in_view(camera, np.concatenate(points)) for camera in cameras])
    static = [i for i in bpy.data.objects if i.type == "MESH" and i.rfgs.object_class == "STATIC"]
    devices = [i for i in bpy.data.objects if i.type == "EMPTY" and i.rfgs.role != "NONE"]
    return {
        "frames": [scene.frame_start, scene.frame_end, scene.render.fps],
        "people": {item.name: [b[n] for b in boxes] for n, item in enumerate(bodies)},
        "faces": {item.name: len(item.data.polygons) for item in bodies},
        "actions": sorted({a.name for a in bpy.data.actions}),
        "seen": seen,
        "static": {i.name: [i.users_collection[0].name, *box(world_vertices(i))] for i in static},
        "devices": {i.name: list(i.matrix_world.translation) for i in devices},
        "materials": {
            m.name: [m.rfgs.radio_material, m.rfgs.thickness_m] for m in bpy.data.materials
        },
        "view_transform": scene.view_settings.view_transform,
    }


def main(out: str, *blends: str) -> None:
    addon_rfgs.register()
    Path(out).write_text(json.dumps({Path(blend).stem: measure(blend) for blend in blends}))
    addon_rfgs.unregister()


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stdout.flush()
    # Python's own end may wait for ever on Blender's threads.
    os._exit(0)
