# SPDX-License-Identifier: Apache-2.0
"""Measures the vehicles of .blend files and writes arrays: `survey_vehicles.py OUT BLEND …`.

Runs in a Python of its own, as one process holds one Blender scene.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import bpy
import numpy as np

import addon_rfgs

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from survey_scene import world_vertices


def of_class(kind: str) -> list[bpy.types.Object]:
    found = [i for i in bpy.data.objects if i.type == "MESH" and i.rfgs.object_class == kind]
    return sorted(found, key=lambda item: item.name)


def measure(blend: str, out: Path) -> dict:
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene, name = bpy.context.scene, Path(blend).stem
    parts, people = of_class("VEHICLE"), of_class("PERSON")
    wheels = [item for item in parts if item.name.endswith(("_left", "_right"))]
    rows: dict[str, list] = {key: [] for key in ("wheels", "roots", "low", "people", "parts")}
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        rows["wheels"].append([np.array(item.matrix_world) for item in wheels])
        rows["roots"].append([np.array(item.parent.matrix_world) for item in wheels])
        rows["low"].append([world_vertices(item)[:, 2].min() for item in wheels])
        if (frame - scene.frame_start) % 5 == 0:
            rows["people"].append(np.concatenate([world_vertices(i)[::20] for i in people]))
            rows["parts"].append(np.concatenate([world_vertices(i) for i in parts]))
    still = np.concatenate([world_vertices(item) for item in of_class("STATIC")])
    np.savez(out / f"{name}.npz", still=still, **{key: np.array(v) for key, v in rows.items()})
    return {
        "wheels": [item.name for item in wheels],
        "parts": {item.name: item.rfgs.instance for item in parts},
        "surface_m2": {i.rfgs.instance: i.rfgs.surface_m2 for i in parts if i.rfgs.surface_m2},
        "area_m2": {i.name: sum(p.area for p in i.data.polygons) for i in parts},
        "materials": {i.name: [m.rfgs.radio_material for m in i.data.materials] for i in parts},
        "sight_rad": [i.data.angle for i in bpy.data.objects if i.type == "CAMERA"],
        "eyes": [list(i.matrix_world.translation) for i in bpy.data.objects if i.type == "CAMERA"],
        "furniture": {
            item.name: [points.min(axis=0).tolist(), points.max(axis=0).tolist()]
            for item in of_class("STATIC")
            if item.users_collection[0].name == "Furniture"
            for points in (world_vertices(item),)
        },
        "lights": sum(i.type == "LIGHT" for i in bpy.data.objects),
    }


def main(out: str, *blends: str) -> None:
    addon_rfgs.register()
    report = {Path(blend).stem: measure(blend, Path(out)) for blend in blends}
    (Path(out) / "vehicles.json").write_text(json.dumps(report))
    addon_rfgs.unregister()


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stdout.flush()
    # Python's own end may wait for ever on Blender's threads.
    os._exit(0)
