# SPDX-License-Identifier: Apache-2.0
"""Builds small .blend files, exports each, and writes what happened; runs in its own Python.

Usage: build_scenes.py FOLDER [NAME…], without a name all of them. Writes FOLDER/<name>.blend,
FOLDER/<name>/ (the bundle) and FOLDER/results.json with errors and with what Blender itself says
about the scenes.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from blank_file import open_blank_file
from mathutils import Vector

import addon_rfgs
from addon_rfgs.cli import open_blend
from addon_rfgs.errors import AddonError
from addon_rfgs.export.bundle import export_bundle

#: Every property of an Empty's radio, none at its default.
OWN_RADIO = {
    "freq_min_ghz": 2.4, "freq_max_ghz": 2.48, "num_subcarriers": 16,
    "tx_rows": 2, "tx_cols": 2, "rx_rows": 2, "rx_cols": 3, "tx_spacing_m": 0.07,
    "rx_spacing_m": 0.06, "tx_offset_m": (0.0, 0.05, -0.2), "own_device_links": "excluded",
    "isolation_db": 12.5, "power_dbm": 7.25, "noise_figure_db": 5.5, "pattern": "hw_dipole",
    "polarization": "VH",
}  # fmt: skip

#: A Mixamo skeleton: bone, parent, head, tail [m]; left is +x.
BONES = [
    ("Hips", None, (0, 0, 1.0), (0, 0, 1.1)),
    ("Spine", "Hips", (0, 0, 1.1), (0, 0, 1.25)),
    ("Spine1", "Spine", (0, 0, 1.25), (0, 0, 1.4)),
    ("Neck", "Spine1", (0, 0, 1.45), (0, 0, 1.55)),
    ("Head", "Neck", (0, 0, 1.55), (0, 0, 1.75)),
]
for _side, _x in (("Left", 1), ("Right", -1)):
    BONES += [
        (f"{_side}UpLeg", "Hips", (0.1 * _x, 0, 0.95), (0.1 * _x, 0, 0.5)),
        (f"{_side}Leg", f"{_side}UpLeg", (0.1 * _x, 0, 0.5), (0.1 * _x, 0, 0.1)),
        (f"{_side}Foot", f"{_side}Leg", (0.1 * _x, 0, 0.1), (0.1 * _x, -0.15, 0.05)),
        (f"{_side}Shoulder", "Spine1", (0.03 * _x, 0, 1.4), (0.15 * _x, 0, 1.4)),
        (f"{_side}Arm", f"{_side}Shoulder", (0.2 * _x, 0, 1.4), (0.45 * _x, 0, 1.4)),
        (f"{_side}ForeArm", f"{_side}Arm", (0.45 * _x, 0, 1.4), (0.7 * _x, 0, 1.4)),
        (f"{_side}Hand", f"{_side}ForeArm", (0.7 * _x, 0, 1.4), (0.85 * _x, 0, 1.4)),
    ]


def box(name: str, low: tuple, high: tuple, material: str | None = None) -> bpy.types.Object:
    """A box with quads, corners given in its own axes."""
    x, y, z = zip(low, high, strict=True)
    points = [(a, b, c) for a in x for b in y for c in z]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], quads)
    if material:
        mesh.materials.append(bpy.data.materials.get(material) or bpy.data.materials.new(material))
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def person(rate: float = 1.0) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Boxes along the bones, one mesh skinned to one armature that walks along +y."""
    data = bpy.data.armatures.new("rig")
    rig = bpy.data.objects.new("rig", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name, parent, head, tail in BONES:
        bone = data.edit_bones.new(f"mixamorig:{name}")
        bone.head, bone.tail = head, tail
        bone.parent = data.edit_bones[f"mixamorig:{parent}"] if parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    points, quads, groups = [], [], []
    for name, _, head, tail in BONES:
        low = np.minimum(head, tail) - 0.06
        high = np.maximum(head, tail) + 0.06
        first = len(points)
        x, y, z = zip(low, high, strict=True)
        points += [(a, b, c) for a in x for b in y for c in z]
        quads += [
            tuple(first + i for i in quad)
            for quad in [
                (0, 1, 3, 2),
                (4, 6, 7, 5),
                (0, 4, 5, 1),
                (2, 3, 7, 6),
                (0, 2, 6, 4),
                (1, 5, 7, 3),
            ]
        ]
        groups.append((f"mixamorig:{name}", range(first, first + 8)))
    mesh = bpy.data.meshes.new("body")
    mesh.from_pydata(points, [], quads)
    mesh.materials.append(bpy.data.materials.new("skin"))
    body = bpy.data.objects.new("body", mesh)
    bpy.context.scene.collection.objects.link(body)
    for name, members in groups:
        body.vertex_groups.new(name=name).add(list(members), 1.0, "REPLACE")
    body.parent = rig
    body.modifiers.new("skin", "ARMATURE").object = rig
    body.rfgs.object_class = "PERSON"
    for frame, y in ((1, -0.5), (5, -0.5 + 1.0 * rate)):
        rig.location = (0, y, 0)
        rig.keyframe_insert("location", frame=frame)
        bone = rig.pose.bones["mixamorig:LeftArm"]
        bone.rotation_mode = "XYZ"
        bone.rotation_euler = (0.3 * (frame - 1), 0, 0)
        bone.keyframe_insert("rotation_euler", frame=frame)
    rig.animation_data.action.name = "stroll"
    return rig, body


def room(scale: float = 1.0) -> None:
    """The scene all others start from: floor, box, person, two cameras, one access point."""
    open_blank_file()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 5
    scene.render.fps = 10
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    scene.world = bpy.data.worlds.new("world")
    floor = box("floor", (-2, -2, 0), (2, 2, 0), "Concrete Floor")
    floor.data.clear_geometry()
    floor.data.from_pydata([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [], [(0, 1, 2, 3)])
    crate = box("crate", (0, 0, 0), (0.5, 0.5, 0.5), "painted")
    crate.location = (1.2, 0.9, 0)
    # Without merging, both halves stay closed boxes.
    crate.modifiers.new("mirror", "MIRROR").use_mirror_merge = False
    person()
    for index, (x, y) in enumerate(((3.0, -1.5), (-2.5, -2.5))):
        camera = bpy.data.objects.new(f"eye{index}", bpy.data.cameras.new(f"eye{index}"))
        camera.data.lens, camera.data.shift_x = 28, 0.05 * index
        camera.location = (x, y, 1.6)
        direction = Vector((0, 0, 0.9)) - camera.location
        camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(camera)
    point = bpy.data.objects.new("ap", None)
    point.location, point.rotation_euler = (-1.5, 1.0, 1.2), (0, 0, pi / 2)
    point.scale = (2, 2, 2)
    point.rfgs.role, point.rfgs.radio = "ACCESS_POINT", "wifi"
    scene.collection.objects.link(point)


def unit_scale() -> None:
    """The same room in centimetres."""
    room()
    parent = bpy.data.objects.new("metres", None)
    bpy.context.scene.collection.objects.link(parent)
    for item in bpy.context.scene.objects:
        if item.parent is None and item != parent:
            item.parent = parent
    parent.scale = (100, 100, 100)
    bpy.context.scene.unit_settings.scale_length = 0.01
    for camera in bpy.data.cameras:
        camera.clip_start, camera.clip_end = 1, 10000


def mirrored() -> None:
    """A crate of negative scale and a flat unlabelled panel."""
    room()
    bpy.data.objects["crate"].scale = (-1, 1, 1)
    box("panel", (-1, 1.9, 0), (1, 1.9, 1))


def instanced() -> None:
    """One box instanced twice by a collection."""
    room()
    stool = box("stool", (0, 0, 0), (0.3, 0.3, 0.4), "oak")
    kit = bpy.data.collections.new("kit")
    bpy.context.scene.collection.objects.unlink(stool)
    kit.objects.link(stool)
    for index in range(2):
        empty = bpy.data.objects.new(f"stools{index}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", kit
        empty.location = (-1.5 + index, -1.5, 0)
        bpy.context.scene.collection.objects.link(empty)


def instanced_moving() -> None:
    """The same, but one instance moves."""
    instanced()
    empty = bpy.data.objects["stools1"]
    for frame in (1, 5):
        empty.location.x = 0.1 * frame
        empty.keyframe_insert("location", frame=frame)


def topology() -> None:
    """A crate that gains copies while the frames go by."""
    room()
    modifier = bpy.data.objects["crate"].modifiers.new("array", "ARRAY")
    for frame, count in ((1, 1), (5, 3)):
        modifier.count = count
        modifier.keyframe_insert("count", frame=frame)


def still() -> None:
    """Nothing moves by a millimetre."""
    room()
    bpy.data.objects["rig"].animation_data_clear()
    crate = bpy.data.objects["crate"]
    for frame in (1, 5):
        crate.location.x = 1.2 + 0.0001 * frame
        crate.keyframe_insert("location", frame=frame)


def static_moves() -> None:
    """Something marked static moves."""
    still()
    crate = bpy.data.objects["crate"]
    crate.location.x = 1.7
    crate.keyframe_insert("location", frame=5)
    crate.rfgs.object_class = "STATIC"


def no_range() -> None:
    """A single frame."""
    room()
    bpy.context.scene.frame_end = 1


def no_mesh() -> None:
    """Only cameras."""
    room()
    for item in [item for item in bpy.data.objects if item.type in {"MESH", "ARMATURE"}]:
        bpy.data.objects.remove(item)


def driver() -> None:
    """A driver that writes a file when it runs, and a text that does so on load."""
    room()
    target = Path(sys.argv[1]) / "scripts_ran"
    code = f"__import__('pathlib').Path({str(target)!r}).write_text('x')"
    curve = bpy.data.objects["crate"].driver_add("location", 2)
    curve.driver.type, curve.driver.expression = "SCRIPTED", f"{code} * 0 + 0.25"
    text = bpy.data.texts.new("startup.py")
    text.write(code)
    text.use_module = True


def vehicles() -> None:
    """A cart with a nominal surface and marked edges, and a trolley without; two meshes each."""
    room()
    for name, y, surface_m2 in (("cart", 1.0, 7.5), ("trolley", 1.6, 0.0)):
        root = bpy.data.objects.new(name, None)
        bpy.context.scene.collection.objects.link(root)
        body = box(f"{name}_body", (0, 0, 0.1), (0.6, 0.4, 0.5), "Steel")
        wheel = box(f"{name}_wheel", (0.1, 0, 0), (0.2, 0.05, 0.1), "rubber")
        for item in (body, wheel):
            item.parent, item.rfgs.object_class, item.rfgs.instance = root, "VEHICLE", name
        wheel.rfgs.surface_m2 = surface_m2
        for frame in (1, 5):
            root.location = (-1.5 + 0.2 * frame, y, 0)
            root.keyframe_insert("location", frame=frame)
    cart = bpy.data.objects["cart_body"].data
    for edge in cart.edges:
        low, high = (cart.vertices[vertex].co.z for vertex in edge.vertices)
        edge.use_edge_sharp = low != high
    cart.shade_smooth()


def own_radio() -> None:
    """Two more Empties, whose properties describe a radio of their own."""
    room()
    for index, x in enumerate((-1.2, 1.4)):
        point = bpy.data.objects.new(f"box{index}", None)
        point.location, point.rotation_euler = (x, -1.0, 1.5), (0, 0, pi * index)
        point.rfgs.role, point.rfgs.radio = "ACCESS_POINT", "scene"
        for name, value in OWN_RADIO.items():
            setattr(point.rfgs.rf, name, value)
        bpy.context.scene.collection.objects.link(point)


def big() -> None:
    """A person of 20,000 vertices over 60 frames."""
    room()
    body = bpy.data.objects["body"]
    body.modifiers.new("fine", "SUBSURF").render_levels = 4
    bpy.context.scene.frame_end = 60


SCENES: tuple[Callable[[], None], ...] = (
    room, unit_scale, mirrored, instanced, instanced_moving, topology, still, static_moves,
    no_range, no_mesh, driver, vehicles, own_radio, big,
)  # fmt: skip


def corners(scene: bpy.types.Scene) -> dict[str, list]:
    """Bounding box of every visible mesh by Blender's own account, in metres."""
    unit = scene.unit_settings.scale_length
    graph, out = bpy.context.evaluated_depsgraph_get(), {}
    for item in scene.objects:
        if item.type == "MESH":
            evaluated = item.evaluated_get(graph)
            points = [evaluated.matrix_world @ Vector(corner) for corner in evaluated.bound_box]
            points = np.array(points) * unit
            out[item.name] = [points.min(axis=0).tolist(), points.max(axis=0).tolist()]
    return out


def main(folder: Path, *names: str) -> None:
    """Builds, exports and reports."""
    addon_rfgs.register()
    results: dict[str, Any] = {}
    for build in SCENES:
        name = build.__name__
        if names and name not in names:
            continue
        build()
        path = folder / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        open_blend(path)
        scene, result = bpy.context.scene, {}
        state = scene.frame_current, len(bpy.data.objects), scene.render.engine
        start = time.perf_counter()
        try:
            export_bundle(scene, folder / name)
        except AddonError as error:
            result["error"] = str(error)
        result["seconds"] = time.perf_counter() - start
        result["unchanged"] = state == (
            scene.frame_current, len(bpy.data.objects), scene.render.engine,
        )  # fmt: skip
        scene.frame_set(3)
        result["boxes"] = corners(scene)
        results[name] = result
    (folder / "results.json").write_text(json.dumps(results))


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
