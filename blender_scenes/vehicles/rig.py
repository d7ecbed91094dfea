# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts vehicles into a scene, standing or driving, as one instance of class vehicle each."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from blender_scenes.shapes import Point
from blender_scenes.vehicles.cars import Model
from blender_scenes.vehicles.driving import Motion


@dataclass(frozen=True)
class Vehicle:
    """A vehicle in the scene."""

    root: bpy.types.Object
    """Empty on the ground below the middle of the fixed axle, x ahead."""
    meshes: list[bpy.types.Object]
    """The body first, then the wheels, then what else was attached."""
    model: Model
    """What it is."""

    def attach(self, item: bpy.types.Object) -> bpy.types.Object:
        """Makes `item`, in the axes of the vehicle, part of it."""
        item.parent = self.root
        if item.type == "MESH":
            _label(item, self.root.name)
            self.meshes.append(item)
        return item


def build_vehicle(name: str, model: Model, collection: bpy.types.Collection) -> Vehicle:
    """Builds a vehicle that will drive, in one piece for masks: instance and root `name`."""
    root = bpy.data.objects.new(name, None)
    root.empty_display_size = 0.3
    collection.objects.link(root)
    vehicle = Vehicle(root, [], model)
    body = vehicle.attach(model.body(f"{name}_body").build(collection))
    body.rfgs.surface_m2 = model.surface_m2
    for wheel in _wheels(name, model, collection):
        vehicle.attach(wheel)
    return vehicle


def park(
    name: str, model: Model, place: Point, yaw: float, collection: bpy.types.Collection
) -> list[bpy.types.Object]:
    """Builds a vehicle that stands for good: part of the environment."""
    body = model.body(f"{name}_body").build(collection)
    items = [body, *_wheels(name, model, collection)]
    cos, sin = np.cos(yaw), np.sin(yaw)
    for item in items:
        x, y, z = item.location
        item.location = (place[0] + cos * x - sin * y, place[1] + sin * x + cos * y, place[2] + z)
        item.rotation_euler = (0.0, 0.0, yaw)
    return items


def key_drive(vehicle: Vehicle, motion: Motion, frame_start: int = 1) -> None:
    """Writes a motion as keys, one per frame."""
    _key(vehicle.root, "location", motion.place_m, frame_start)
    _key(vehicle.root, "rotation_euler", motion.turn_rad, frame_start)
    chassis = vehicle.model.chassis
    wheels = {item.name.removeprefix(f"{vehicle.root.name}_"): item for item in vehicle.meshes}
    for name, (x, y) in chassis.wheels_m.items():
        steer, spin = motion.steer_rad[name], motion.spin_rad[name]
        # Euler order XYZ is Rz · Ry · Rx: the wheel spins about its axle, then steers.
        turns = np.stack([np.zeros_like(spin), spin, steer], axis=1)
        _key(wheels[name], "rotation_euler", turns, frame_start)
        height = chassis.radius_m[name] + motion.lift_m[name]
        places = np.stack([np.full_like(height, x), np.full_like(height, y), height], axis=1)
        _key(wheels[name], "location", places, frame_start)


def _wheels(name: str, model: Model, collection: bpy.types.Collection) -> list[bpy.types.Object]:
    made = []
    for wheel, (x, y) in model.chassis.wheels_m.items():
        radius = model.chassis.radius_m[wheel]
        outer = 1.0 if y > 0 else -1.0
        built = model.wheel(f"{name}_{wheel}", radius, model.tyre_m[wheel], outer=outer)
        made.append(built.build(collection, location=(x, y, radius)))
    return made


def _label(item: bpy.types.Object, instance: str) -> None:
    item.rfgs.object_class, item.rfgs.instance = "VEHICLE", instance


def _key(item: bpy.types.Object, path: str, values: np.ndarray, frame_start: int) -> None:
    """Keys a vector property, one row per frame."""
    for frame, value in enumerate(values, start=frame_start):
        setattr(item, path, value.tolist())
        item.keyframe_insert(path, frame=frame)
    item.animation_data.action.name = f"{item.name}_drive"
