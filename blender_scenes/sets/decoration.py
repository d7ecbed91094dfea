# SPDX-License-Identifier: GPL-3.0-or-later
"""Curtains, pictures, lamps and the plant."""

from __future__ import annotations

import math

import bpy

from blender_scenes.sets.lighting import NEUTRAL, bulb, soft_light, sun
from blender_scenes.shapes import Builder, Point

#: Outline of a leaf: distance from the foot and width as shares of its length, rise [m].
_LEAF = ((0.12, 0.01, 0.03), (0.4, 0.34, 0.14), (0.7, 0.30, 0.15), (1.0, 0.01, 0.02))


def build_decoration(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Builds and places everything that makes the room look lived in."""
    pieces = [
        curtain("curtain_left").build(collection, location=(2.90, 0.80, 0.0)),
        curtain("curtain_right").build(collection, location=(2.90, -1.50, 0.0)),
        curtain_rod().build(collection),
        door_handle().build(collection, location=(-3.0, -1.0, 1.03)),
        floor_lamp().build(collection, location=(-1.42, -2.10, 0.0)),
        ceiling_light().build(collection, location=(0.0, 0.1, 0.0)),
        plant().build(collection, location=(-1.18, 2.17, 0.0)),
    ]
    wall_y = -2.5 + 0.014
    for name, x, z, size, paint in (
        ("picture_left", -0.62, 1.58, (0.46, 0.62), "paint_teal"),
        ("picture_middle", 0.0, 1.58, (0.46, 0.62), "paint_sand"),
        ("picture_right", 0.62, 1.58, (0.46, 0.62), "paint_rust"),
    ):
        pieces.append(picture(name, size, paint).build(collection, location=(x, wall_y, z)))
    return pieces


def light_room(collection: bpy.types.Collection) -> None:
    """Afternoon sun through the east window, a soft ceiling and the floor lamp."""
    sun((-0.80, 0.12, -0.70), 5.0, (1.0, 0.90, 0.76), collection)
    soft_light("soft_ceiling", (0.0, 0.0, 2.58), (3.6, 2.8), 62.0, NEUTRAL, collection)
    glow = soft_light(
        "window_glow", (2.94, -0.35, 1.52), (1.7, 1.25), 42.0, (0.86, 0.93, 1.0), collection
    )
    glow.rotation_euler = (0.0, math.radians(90), 0.0)
    bulb("floor_lamp_bulb", (-1.42, -2.10, 1.45), 9.0, (1.0, 0.78, 0.5), collection)


def curtain(name: str) -> Builder:
    """A pleated sheet of linen, 0.55 m wide, hanging in the y-z plane."""
    cloth = Builder(name)
    count = 24
    rows = []
    for z, spread in ((0.03, 1.0), (1.2, 0.94), (2.40, 0.9)):
        row: list[Point] = []
        for index in range(count + 1):
            y = (index / count - 0.5) * 0.55 * spread
            row.append((0.035 * math.sin(index * math.pi / 2 + 0.4), y, z))
        rows.append(row)
    cloth.sheet(rows, "curtain_linen")
    return cloth


def curtain_rod() -> Builder:
    """The brass rod both curtains hang on."""
    rod = Builder("curtain_rod")
    rod.rod((2.90, -1.85, 2.43), (2.90, 1.15, 2.43), 0.012, "brass")
    for y in (-1.86, 1.16):
        rod.lathe(
            [(0.008, -0.025), (0.025, 0.0), (0.008, 0.025)], (2.90, y, 2.43), "brass", sides=10
        )
    return rod


def door_handle() -> Builder:
    """A lever of brass, clear of the door by more than a centimetre."""
    handle = Builder("door_handle")
    handle.rod((-0.022, 0, 0), (0.03, 0, 0), 0.012, "brass")
    handle.rod((0.03, 0.012, 0), (0.03, -0.11, 0), 0.009, "brass")
    return handle


def floor_lamp() -> Builder:
    """A slim lamp with a cloth shade."""
    lamp = Builder("floor_lamp")
    lamp.lathe([(0.14, 0.0), (0.14, 0.018), (0.02, 0.03)], (0, 0, 0.013), "black_metal", sides=20)
    lamp.rod((0, 0, 0.035), (0, 0, 1.42), 0.011, "black_metal")
    lamp.lathe([(0.19, 1.28), (0.13, 1.56)], (0, 0, 0), "lamp_shade", sides=24, caps=False)
    return lamp


def ceiling_light() -> Builder:
    """A flat round light just below the ceiling."""
    light = Builder("ceiling_light")
    profile = [(0.20, 2.61), (0.24, 2.625), (0.24, 2.675), (0.20, 2.685)]
    light.lathe(profile, (0, 0, 0), "ceiling_light", sides=24)
    return light


def picture(name: str, size: tuple[float, float], paint: str) -> Builder:
    """A framed abstract print: one flat sheet of strips, looking along +y."""
    frame = Builder(name)
    width, height = size
    xs = [0.5 * width, 0.44 * width, 0.30 * width]
    zs = [0.5 * height, 0.455 * height, 0.33 * height]
    us = [*xs, -xs[2], -xs[1], -xs[0]]
    vs = [-zs[0], -zs[1], -zs[2], zs[2], zs[1], zs[0]]
    for column in range(5):
        for row in range(5):
            ring = min(column, row, 4 - column, 4 - row)
            surface = ("black_metal", "paper_white", paint)[ring]
            low, high = vs[row], vs[row + 1]
            left, right = us[column], us[column + 1]
            frame.sheet(
                [[(left, 0, low), (right, 0, low)], [(left, 0, high), (right, 0, high)]], surface
            )
    return frame


def plant() -> Builder:
    """A rubber plant in a pot: every leaf is a single bent sheet."""
    tree = Builder("plant")
    pot = [(0.10, 0.0), (0.135, 0.25), (0.14, 0.27), (0.125, 0.27), (0.12, 0.24)]
    tree.lathe(pot, (0, 0, 0.013), "terracotta", sides=20, caps=False)
    tree.lathe([(0.122, 0.0), (0.121, 0.012)], (0, 0, 0.24), "soil", sides=20)
    tree.rod((0, 0, 0.24), (0.02, 0.01, 1.02), 0.012, "walnut", taper=0.6)
    for index in range(22):
        # The golden angle spreads leaves round the stem as real plants do.
        angle = 2.399963 * index
        z = 0.42 + 0.62 * index / 21
        reach = 0.33 - 0.19 * index / 21
        _leaf(tree, (0.02 * index / 21, 0, z), angle, reach)
    return tree


def _leaf(tree: Builder, foot: Point, angle: float, reach: float) -> None:
    """A leaf of length `reach` [m] that rises from `foot` and bends over."""
    cos, sin = math.cos(angle), math.sin(angle)
    rows = []
    for share, width, rise in _LEAF:
        along, half = share * reach, 0.5 * width * reach
        row: list[Point] = []
        for side, fold in ((-1, 0.12), (0, 0.0), (1, 0.12)):
            across = side * half
            row.append(
                (
                    foot[0] + along * cos - across * sin,
                    foot[1] + along * sin + across * cos,
                    foot[2] + rise + fold * half,
                )
            )
        rows.append(row)
    tree.sheet(rows, "leaf")
