# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps: the sun, rectangles of soft light, and bulbs."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
from mathutils import Vector

Colour = tuple[float, float, float]
Point = tuple[float, float, float]

WARM: Colour = (1.0, 0.80, 0.56)
NEUTRAL: Colour = (1.0, 0.96, 0.90)
COOL: Colour = (0.84, 0.92, 1.0)


def lamp(
    name: str, kind: str, power: float, colour: Colour, collection: bpy.types.Collection
) -> bpy.types.Object:
    """A light of Blender's `kind`; `power` in watts, W/m² for the sun."""
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = power, colour
    made = bpy.data.objects.new(name, data)
    collection.objects.link(made)
    return made


def sun(
    towards: Point, strength: float, colour: Colour, collection: bpy.types.Collection
) -> bpy.types.Object:
    """Sunlight that travels along `towards`."""
    made = lamp("sun", "SUN", strength, colour, collection)
    made.data.angle = 0.02
    made.rotation_euler = Vector(towards).to_track_quat("-Z", "Y").to_euler()
    return made


def soft_light(
    name: str,
    place: Point,
    size: tuple[float, float],
    power: float,
    colour: Colour,
    collection: bpy.types.Collection,
    *,
    towards: Point = (0.0, 0.0, -1.0),
) -> bpy.types.Object:
    """A rectangle of light that no camera sees."""
    made = lamp(name, "AREA", power, colour, collection)
    made.data.shape, made.data.size, made.data.size_y = "RECTANGLE", *size
    made.location = place
    made.rotation_euler = Vector(towards).to_track_quat("-Z", "Y").to_euler()
    made.visible_camera = made.visible_glossy = False
    return made


def bulb(
    name: str, place: Point, power: float, colour: Colour, collection: bpy.types.Collection
) -> bpy.types.Object:
    """A small warm point of light."""
    made = lamp(name, "POINT", power, colour, collection)
    made.data.shadow_soft_size = 0.05
    made.location = place
    return made


def ceiling_row(
    places: Sequence[Point],
    size: tuple[float, float],
    power: float,
    colour: Colour,
    collection: bpy.types.Collection,
) -> list[bpy.types.Object]:
    """Equal soft lights below the ceiling."""
    return [
        soft_light(f"ceiling_light_{index}", place, size, power, colour, collection)
        for index, place in enumerate(places)
    ]
