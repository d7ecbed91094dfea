# SPDX-License-Identifier: GPL-3.0-or-later
"""Bed, wardrobe and what stands beside them; pieces look along local +y."""

from __future__ import annotations

from blender_scenes.shapes import Builder

GAP_M = 0.012


def bed(name: str) -> Builder:
    """A double bed, 1.5 x 2.1 m, its head at -y, with a blanket turned back."""
    made = Builder(name)
    made.box((1.56, 2.10, 0.16), (0, 0, 0.24), "oak", bevel=0.01, segments=2)
    made.box((1.60, 0.06, 0.95), (0, -1.06, GAP_M + 0.475), "oak", bevel=0.015, segments=2)
    for x in (-0.7, 0.7):
        for y in (-0.95, 0.95):
            made.box((0.07, 0.07, 0.14), (x, y, GAP_M + 0.07), "oak", bevel=0.005)
    made.box((1.48, 2.0, 0.20), (0, 0, 0.43), "linen_white", bevel=0.05, segments=3)
    made.box((1.54, 1.30, 0.09), (0, 0.36, 0.565), "blanket", bevel=0.04, segments=3)
    made.box((1.54, 0.30, 0.06), (0, -0.36, 0.625), "linen_white", bevel=0.028, segments=3)
    for x in (-0.37, 0.37):
        made.box(
            (0.62, 0.40, 0.14),
            (x, -0.78, 0.61),
            "linen_white",
            bevel=0.06,
            segments=3,
            tilt=(-0.25, 0, 0.04 if x > 0 else -0.03),
        )
    return made


def nightstand(name: str) -> Builder:
    """A small chest of two drawers with a book and a lamp."""
    stand = Builder(name)
    stand.box((0.45, 0.38, 0.42), (0, 0, 0.29), "oak", bevel=0.008, segments=2)
    for z in (0.20, 0.38):
        stand.box((0.40, 0.015, 0.15), (0, 0.205, z), "white_wood", bevel=0.004)
        stand.box((0.08, 0.02, 0.012), (0, 0.222, z), "brass", bevel=0.003)
    for x in (-0.18, 0.18):
        for y in (-0.14, 0.14):
            stand.rod((x, y, 0.085), (x, y, GAP_M), 0.016, "black_metal")
    stand.box((0.15, 0.21, 0.03), (-0.10, 0.05, 0.516), "book_red", bevel=0.003)
    stand.lathe([(0.06, 0.0), (0.055, 0.015), (0.012, 0.03)], (0.1, -0.05, 0.502), "brass")
    stand.rod((0.1, -0.05, 0.53), (0.1, -0.05, 0.74), 0.008, "brass")
    stand.lathe([(0.11, 0.70), (0.07, 0.88)], (0.1, -0.05, 0.0), "lamp_shade", caps=False)
    return stand


def wardrobe(name: str) -> Builder:
    """A wardrobe with three doors, one of them a mirror."""
    case = Builder(name)
    case.box((1.65, 0.58, 2.10), (0, 0, 1.08), "white_wood", bevel=0.008)
    for index, surface in enumerate(("wardrobe_door", "mirror", "wardrobe_door")):
        x = 0.545 * (index - 1)
        case.box((0.53, 0.02, 2.02), (x, 0.302, 1.08), surface, bevel=0.004)
        case.box((0.018, 0.03, 0.22), (x + 0.21, 0.325, 1.05), "brass", bevel=0.004)
    return case


def dresser(name: str) -> Builder:
    """A low chest of six drawers with a vase."""
    chest = Builder(name)
    chest.box((1.15, 0.45, 0.70), (0, 0, 0.43), "oak", bevel=0.008, segments=2)
    for x in (-0.285, 0.285):
        for z in (0.20, 0.42, 0.64):
            chest.box((0.53, 0.016, 0.195), (x, 0.235, z), "white_wood", bevel=0.004)
            chest.box((0.10, 0.02, 0.012), (x, 0.254, z), "brass", bevel=0.003)
    for x in (-0.5, 0.5):
        for y in (-0.17, 0.17):
            chest.rod((x, y, 0.085), (x, y, GAP_M), 0.02, "oak")
    vase = [(0.05, 0.0), (0.085, 0.07), (0.08, 0.15), (0.035, 0.22), (0.045, 0.26)]
    chest.lathe(vase, (-0.36, 0.0, 0.785), "terracotta")
    chest.box((0.20, 0.15, 0.04), (0.30, 0.02, 0.805), "book_cream", bevel=0.003)
    return chest
