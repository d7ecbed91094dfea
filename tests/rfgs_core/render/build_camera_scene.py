# SPDX-License-Identifier: Apache-2.0
"""Saves a Blender file with a moving torus and cameras that differ in every intrinsic.

Runs in a Python of its own, as one process holds one Blender scene.
"""

from __future__ import annotations

import sys

import bpy

import addon_rfgs


def camera(name: str, place: tuple[float, float, float], lens_mm: float) -> bpy.types.Object:
    data = bpy.data.cameras.new(name)
    data.lens = lens_mm
    item = bpy.data.objects.new(name, data)
    item.location = place
    target = bpy.data.objects["Target"]
    constraint = item.constraints.new("TRACK_TO")
    constraint.target, constraint.track_axis, constraint.up_axis = (
        target,
        "TRACK_NEGATIVE_Z",
        "UP_Y",
    )
    bpy.context.scene.collection.objects.link(item)
    return item


def main(out: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_rfgs.register()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 2, 10
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    bpy.ops.mesh.primitive_plane_add(size=4.0, location=(0.0, 0.0, 0.0))
    bpy.context.object.name = "Floor"
    bpy.ops.mesh.primitive_torus_add(
        major_radius=0.6, minor_radius=0.25, location=(0.1, 0.0, 1.0), rotation=(0.7, 0.3, 0.2)
    )
    torus = bpy.context.object
    torus.name = "Torus"
    torus.rfgs.object_class = "PERSON"
    torus.keyframe_insert("location", frame=1)
    torus.location.x = 0.4
    torus.keyframe_insert("location", frame=2)
    target = bpy.data.objects.new("Target", None)
    target.location = (0.2, 0.1, 0.9)
    scene.collection.objects.link(target)
    camera("A wide", (2.5, -2.0, 1.8), 24.0)
    camera("B shifted", (-2.0, -2.5, 2.4), 40.0).data.shift_x = 0.15
    shifted = camera("C vertical fit", (0.3, 3.0, 1.0), 35.0).data
    shifted.sensor_fit, shifted.shift_y = "VERTICAL", -0.1
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.location = 200.0, (1.0, -1.0, 3.0)
    scene.collection.objects.link(lamp)
    scene.camera = bpy.data.objects["A wide"]
    bpy.ops.wm.save_as_mainfile(filepath=out, compress=True)
    addon_rfgs.unregister()


main(*sys.argv[1:])
