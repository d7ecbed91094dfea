# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands outdoors: ground, markings, trees, posts and street furniture.

Paint on the ground, leaves and everything beyond the scene's bounds are for the eye only: they
have the class Ignore.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import bpy
import numpy as np

from blender_scenes.shapes import Builder, Point

GAP_M = 0.012
#: How far paint lies above the ground, so that it wins in pictures [m].
_PAINT_M = 0.006


def ground(
    name: str,
    xs: Sequence[float],
    ys: Sequence[float],
    surface: Callable[[float, float], str],
    height: Callable[[float, float], float],
) -> Builder:
    """A single sheet over a grid of lines [m].

    Args:
        name: Name of the object.
        xs: Ascending lines along y.
        ys: Ascending lines along x.
        surface: Surface of the cell around a point.
        height: Height [m] at a point, looked up just inside each cell: where neighbours differ,
            an upright strip joins them, as at a kerb.
    """
    made = Builder(name)
    for x0, x1 in pairwise(xs):
        edge: tuple[float, float] | None = None
        for y0, y1 in pairwise(ys):
            what = surface(0.5 * (x0 + x1), 0.5 * (y0 + y1))
            inside = 1e-6
            low = [(x, y0, height(x, y0 + inside)) for x in (x0, x1)]
            high = [(x, y1, height(x, y1 - inside)) for x in (x0, x1)]
            if edge is not None and abs(edge[0] - low[0][2]) > 1e-4:
                step = [(x0, y0, edge[0]), (x1, y0, edge[1])]
                made.sheet([step, low], "kerb_stone")
            made.sheet([low, high], what)
            edge = (high[0][2], high[1][2])
    return made


def for_the_eye(item: bpy.types.Object) -> bpy.types.Object:
    """Makes an object invisible to radio."""
    item.rfgs.object_class = "IGNORE"
    return item


def paint(name: str, stripes: Sequence[tuple[Point, Point, float]], surface: str) -> Builder:
    """Straight stripes on the ground: from, to, width [m]."""
    made = Builder(name)
    for start, end, width in stripes:
        way = np.array(end[:2]) - np.array(start[:2])
        across = 0.5 * width * np.array([-way[1], way[0]]) / np.hypot(*way)
        rows = [
            [
                (x - across[0], y - across[1], z + _PAINT_M),
                (x + across[0], y + across[1], z + _PAINT_M),
            ]
            for x, y, z in (start, end)
        ]
        made.sheet([row[::-1] for row in rows], surface)
    return made


def tree(name: str, height_m: float, crown: str, seed: int) -> tuple[Builder, Builder]:
    """A trunk with branches, and its crown of leaves."""
    trunk, leaves = Builder(f"{name}_trunk"), Builder(f"{name}_crown")
    rng = np.random.default_rng(seed)
    fork = 0.52 * height_m
    trunk.rod((0, 0, GAP_M), (0.03, 0.02, fork), 0.035 * height_m, "bark", taper=0.65)
    for index in range(9):
        turn = 2.4 * index + rng.uniform(-0.3, 0.3)
        rise, reach = rng.uniform(0.02, 0.40), rng.uniform(0.10, 0.24)
        tip = (
            reach * height_m * math.cos(turn),
            reach * height_m * math.sin(turn),
            fork + rise * height_m,
        )
        if index % 2 == 0:
            trunk.rod((0.03, 0.02, fork - 0.05), tip, 0.012 * height_m, "bark", taper=0.5)
        _clump(leaves, tip, (0.13 + 0.06 * rng.random()) * height_m, crown, rng)
    return trunk, leaves


def bush(name: str, length_m: float, height_m: float, leaf: str, seed: int) -> Builder:
    """A clipped hedge along x, for the eye."""
    made, rng = Builder(name), np.random.default_rng(seed)
    count = max(2, round(length_m / (0.55 * height_m)))
    for index in range(count):
        x = (index / (count - 1) - 0.5) * (length_m - 0.6 * height_m)
        _clump(made, (x, 0.05 * rng.normal(), 0.5 * height_m), 0.55 * height_m, leaf, rng)
    return made


def _clump(
    made: Builder, centre: Point, radius_m: float, surface: str, rng: np.random.Generator
) -> None:
    """A lumpy ball of leaves."""
    rings, sides = 7, 10
    points: list[Point] = []
    for ring in range(rings):
        tilt = math.pi * (ring + 0.5) / rings
        for side in range(sides):
            turn = 2 * math.pi * (side + 0.5 * (ring % 2)) / sides
            r = radius_m * rng.uniform(0.78, 1.12)
            points.append(
                (
                    centre[0] + r * math.sin(tilt) * math.cos(turn),
                    centre[1] + r * math.sin(tilt) * math.sin(turn),
                    centre[2] + 0.85 * r * math.cos(tilt),
                )
            )
    faces = [[side for side in range(sides)]]
    for ring in range(rings - 1):
        for side in range(sides):
            after, here, there = (side + 1) % sides, ring * sides, (ring + 1) * sides
            faces.append([here + side, there + side, there + after, here + after])
    faces.append([(rings - 1) * sides + side for side in range(sides)])
    made.polygons(points, faces, [surface] * len(faces))


def lamp_post(name: str, height_m: float, arm_m: float, glow: str, metal: str) -> Builder:
    """A post whose arm reaches along +x and carries a lamp."""
    made = Builder(name)
    made.lathe(
        [(0.09, GAP_M), (0.085, 0.5), (0.055, 0.6), (0.045, height_m)], (0, 0, 0), metal, sides=12
    )
    made.rod((0, 0, height_m - 0.05), (arm_m, 0, height_m + 0.12), 0.03, metal, taper=0.8)
    made.box((0.50, 0.17, 0.07), (arm_m + 0.1, 0, height_m + 0.12), metal, bevel=0.02)
    made.box((0.40, 0.12, 0.03), (arm_m + 0.1, 0, height_m + 0.072), glow)
    return made


def bollard(name: str) -> Builder:
    """A steel bollard with a white band."""
    made = Builder(name)
    made.lathe([(0.055, GAP_M), (0.055, 0.72)], (0, 0, 0), "post_steel", sides=14, caps=True)
    made.lathe([(0.057, 0.72), (0.057, 0.84), (0.03, 0.90)], (0, 0, 0), "line_white", sides=14)
    return made


def ticket_machine(name: str) -> Builder:
    """A parking meter with a lit display and a sign on top; it looks along +x."""
    made = Builder(name)
    made.box((0.34, 0.42, 1.45), (0, 0, GAP_M + 0.725), "post_steel", bevel=0.03, segments=2)
    made.box((0.02, 0.26, 0.18), (0.172, 0, 1.18), "shop_glow_cool", bevel=0.004)
    made.box((0.03, 0.20, 0.10), (0.172, 0, 0.86), "plastic_black", bevel=0.006)
    made.rod((0, 0, 1.46), (0, 0, 2.25), 0.03, "post_steel")
    made.box((0.03, 0.5, 0.5), (0.045, 0, 2.30), "sign_blue", bevel=0.01)
    made.box((0.014, 0.10, 0.32), (0.072, 0.06, 2.30), "paper_white")
    made.box((0.014, 0.20, 0.08), (0.072, -0.02, 2.42), "paper_white")
    made.box((0.014, 0.20, 0.08), (0.072, -0.02, 2.30), "paper_white")
    return made


def street_bin(name: str) -> Builder:
    """A round litter bin."""
    made = Builder(name)
    made.lathe(
        [(0.20, GAP_M), (0.23, 0.70), (0.24, 0.72), (0.24, 0.80), (0.15, 0.86)],
        (0, 0, 0),
        "post_green",
        sides=18,
    )
    return made


def trolleys(name: str, count: int = 5) -> Builder:
    """Shopping trolleys pushed into each other along +x."""
    made = Builder(name)
    for index in range(count):
        x = 0.30 * index
        for y in (-0.24, 0.24):
            made.rod((x, y, 0.16), (x + 0.85, y * 0.85, 0.20), 0.014, "alloy")
            made.rod((x, y, 0.16), (x - 0.02, y, 1.0), 0.014, "alloy")
            made.rod((x, y, 0.62), (x + 0.85, y * 0.8, 0.75), 0.012, "alloy")
            made.rod((x + 0.85, y * 0.8, 0.40), (x + 0.85, y * 0.8, 0.75), 0.012, "alloy")
            made.rod((x + 0.05, y, 0.07), (x + 0.05, y, 0.17), 0.05, "tyre")
            made.rod((x + 0.80, y * 0.85, 0.07), (x + 0.80, y * 0.85, 0.17), 0.05, "tyre")
        made.rod((x - 0.02, -0.26, 1.0), (x - 0.02, 0.26, 1.0), 0.018, "fire_red")
    return made
