# SPDX-License-Identifier: GPL-3.0-or-later
"""Wheels whose turning one can see; the axle is local y, the outer side looks along +y."""

from __future__ import annotations

import math

from blender_scenes.shapes import Builder

_SPOKES = 5


def wheel(name: str, radius_m: float, width_m: float, *, outer: float = 1.0) -> Builder:
    """A tyre on a spoked rim; `outer` is 1 on the left of a vehicle and −1 on its right."""
    made = Builder(name)
    half, rim = width_m / 2, 0.66 * radius_m
    tyre = [
        (rim, -half),
        (0.93 * radius_m, -half),
        (radius_m, -0.55 * half),
        (radius_m, 0.55 * half),
        (0.93 * radius_m, half),
        (rim, half),
    ]
    made.lathe(tyre, (0, 0, 0), "tyre", sides=24, axis="y")
    face = outer * (half + 0.001)
    dish = sorted([(rim - 0.01, outer * (half - 0.03)), (rim - 0.01, face)], key=lambda p: p[1])
    made.lathe(dish, (0, 0, 0), "rim_dark", sides=24, axis="y")
    for spoke in range(_SPOKES):
        turn = 2 * math.pi * spoke / _SPOKES
        middle = 0.5 * rim
        made.box(
            (0.22 * rim, 0.024, 0.94 * rim),
            (middle * math.sin(turn), face, middle * math.cos(turn)),
            "alloy",
            bevel=0.006,
            tilt=(0.0, turn, 0.0),
        )
    hub = sorted(
        [(0.22 * rim, outer * (half - 0.02)), (0.18 * rim, outer * (half + 0.02))],
        key=lambda p: p[1],
    )
    made.lathe(hub, (0, 0, 0), "alloy", sides=12, axis="y")
    return made


def solid_wheel(name: str, radius_m: float, width_m: float, *, outer: float = 1.0) -> Builder:
    """A solid rubber tyre on a painted disc with bolts, as forklifts have them."""
    made = Builder(name)
    half, rim = width_m / 2, 0.6 * radius_m
    tyre = [(rim, -half), (radius_m, -0.8 * half), (radius_m, 0.8 * half), (rim, half)]
    made.lathe(tyre, (0, 0, 0), "tyre", sides=20, axis="y")
    face = outer * (half + 0.002)
    disc = sorted([(0.95 * rim, outer * (half - 0.02)), (0.9 * rim, face)], key=lambda p: p[1])
    made.lathe(disc, (0, 0, 0), "machine_grey", sides=20, axis="y")
    for bolt in range(6):
        turn = 2 * math.pi * bolt / 6
        place = (0.6 * rim * math.sin(turn), face, 0.6 * rim * math.cos(turn))
        made.box((0.03, 0.02, 0.03), place, "black_metal", tilt=(0.0, turn, 0.0))
    return made
