# SPDX-License-Identifier: GPL-3.0-or-later
"""Sofa, armchair, chairs and cushions; a seat looks along local +y."""

from __future__ import annotations

from itertools import pairwise

from blender_scenes.shapes import Builder


def sofa() -> Builder:
    """A three-seat sofa, 2.1 m wide, on short wooden legs."""
    seat = Builder("sofa")
    cloth = "sofa_cloth"
    seat.box((2.06, 0.82, 0.20), (0, 0.0, 0.24), cloth, bevel=0.025, segments=2)
    seat.box((1.80, 0.20, 0.46), (0, -0.31, 0.57), cloth, bevel=0.05, segments=3)
    for x in (-0.95, 0.95):
        seat.box((0.19, 0.84, 0.44), (x, 0.0, 0.38), cloth, bevel=0.05, segments=3)
    for x in (-0.565, 0.0, 0.565):
        seat.box((0.55, 0.62, 0.15), (x, 0.10, 0.405), cloth, bevel=0.045, segments=3)
        seat.box(
            (0.54, 0.17, 0.40), (x, -0.15, 0.64), cloth, bevel=0.06, segments=3, tilt=(0.16, 0, 0)
        )
    for x in (-0.93, 0.93):
        for y in (-0.33, 0.33):
            seat.rod((x, y, 0.15), (x * 1.01, y * 1.03, 0.018), 0.028, "walnut", taper=0.65)
    return seat


def armchair() -> Builder:
    """A low armchair with rounded arms on thin legs."""
    seat = Builder("armchair")
    cloth = "armchair_cloth"
    seat.box((0.62, 0.66, 0.16), (0, 0.02, 0.27), cloth, bevel=0.03, segments=2)
    seat.box((0.54, 0.56, 0.14), (0, 0.06, 0.405), cloth, bevel=0.05, segments=3)
    seat.box((0.66, 0.15, 0.56), (0, -0.30, 0.58), cloth, bevel=0.06, segments=3, tilt=(0.2, 0, 0))
    for x in (-0.35, 0.35):
        seat.box((0.11, 0.64, 0.38), (x, 0.01, 0.40), cloth, bevel=0.045, segments=3)
        for y in (-0.25, 0.27):
            seat.rod((x * 0.9, y, 0.20), (x, y * 1.1, 0.018), 0.02, "walnut", taper=0.6)
    return seat


def chair(name: str) -> Builder:
    """A dining chair of oak and black metal with a curved back."""
    seat = Builder(name)
    seat.box((0.43, 0.42, 0.03), (0, 0, 0.455), "oak", bevel=0.012, segments=2)
    for x in (-0.18, 0.18):
        seat.rod((x, 0.17, 0.44), (x * 1.1, 0.195, 0.018), 0.014, "black_metal")
        seat.rod((x, -0.17, 0.44), (x * 1.1, -0.205, 0.018), 0.014, "black_metal")
        seat.rod((x, -0.19, 0.44), (x * 0.98, -0.245, 0.82), 0.013, "black_metal")
    backs = [(x / 10, -0.235 - 0.03 * (1 - (x / 2) ** 2)) for x in (-2, -1, 0, 1, 2)]
    for (x0, y0), (x1, y1) in pairwise(backs):
        centre = ((x0 + x1) / 2, (y0 + y1) / 2, 0.755)
        turn = (y1 - y0) / (x1 - x0)
        seat.box((0.106, 0.018, 0.17), centre, "oak", bevel=0.004, tilt=(0.14, 0, turn))
    return seat


def cushion(surface: str) -> Builder:
    """A cushion leaning against a backrest."""
    pillow = Builder(f"{surface.replace('cushion', 'pillow')}")
    pillow.box((0.42, 0.13, 0.40), (0, 0, 0), surface, bevel=0.06, segments=3, tilt=(0.35, 0, 0))
    return pillow
