# SPDX-License-Identifier: GPL-3.0-or-later
"""What a warehouse holds: pallet racks, loaded pallets, drums; fronts look along −y."""

from __future__ import annotations

import numpy as np

from blender_scenes.shapes import Builder

GAP_M = 0.012
BAY_M, DEPTH_M = 2.75, 1.0
#: Upper sides of the beams pallets stand on, the ground first [m].
LEVELS_M = (0.0, 1.55, 3.05)
_CARTONS = ("carton", "carton_pale", "carton", "crate_blue", "carton_pale", "crate_green")


def rack(name: str, bays: int, height_m: float = 4.3) -> Builder:
    """Upright frames with braces, and a pair of beams per level; the middle is x = y = 0."""
    made = Builder(name)
    left = -0.5 * bays * BAY_M
    for index in range(bays + 1):
        x = left + index * BAY_M
        for y in (-0.5 * DEPTH_M, 0.5 * DEPTH_M):
            made.box((0.09, 0.08, height_m), (x, y, GAP_M + 0.5 * height_m), "rack_blue")
            made.box((0.16, 0.16, 0.01), (x, y, GAP_M + 0.005), "rack_blue")
        for step in range(4):
            z = 0.3 + step * (height_m - 0.6) / 4
            turn = 1 if step % 2 else -1
            made.rod(
                (x, -turn * 0.44, z),
                (x, turn * 0.44, z + (height_m - 0.6) / 4),
                0.018,
                "rack_blue",
            )
    for level in LEVELS_M[1:]:
        for bay in range(bays):
            x = left + (bay + 0.5) * BAY_M
            for y in (-0.5 * DEPTH_M, 0.5 * DEPTH_M):
                made.box((BAY_M - 0.11, 0.05, 0.12), (x, y, level - 0.06), "rack_orange")
    return made


def pallet(name: str, seed: int, height_m: float = 0.95) -> Builder:
    """A pallet of 1.2 m by 0.8 m with cartons stacked on it."""
    made, rng = Builder(name), np.random.default_rng(seed)
    for y in (-0.34, 0.0, 0.34):
        made.box((1.2, 0.10, 0.09), (0, y, 0.058), "pallet_wood")
    for index in range(5):
        made.box((1.2, 0.13, 0.02), (0, -0.33 + 0.165 * index, 0.128), "pallet_wood")
    surface = _CARTONS[seed % len(_CARTONS)]
    columns, rows = ((3, 2), (2, 2), (4, 2))[seed % 3]
    layers = 2 + seed % 2
    tall = (height_m - 0.15) / layers
    for layer in range(layers):
        for column in range(columns):
            for row in range(rows):
                if layer == layers - 1 and rng.random() < 0.22:
                    continue
                wide, deep = 1.14 / columns, 0.76 / rows
                made.box(
                    (wide - 0.02, deep - 0.02, tall - 0.012),
                    (
                        (column - 0.5 * (columns - 1)) * wide,
                        (row - 0.5 * (rows - 1)) * deep,
                        0.152 + (layer + 0.5) * tall,
                    ),
                    surface,
                    tilt=(0.0, 0.0, rng.uniform(-0.03, 0.03)),
                )
    return made


def drum(name: str) -> Builder:
    """A steel drum of 200 litres."""
    made = Builder(name)
    profile = [
        (0.285, GAP_M),
        (0.29, 0.28),
        (0.302, 0.30),
        (0.29, 0.32),
        (0.29, 0.56),
        (0.302, 0.58),
        (0.29, 0.60),
        (0.285, 0.88),
    ]
    made.lathe(profile, (0, 0, 0), "drum_blue", sides=20)
    return made


def high_bay_lamp(name: str) -> Builder:
    """A long lit tray that hangs from the roof; z = 0 is its lower side."""
    made = Builder(name)
    made.box((1.5, 0.30, 0.07), (0, 0, 0.045), "machine_grey", bevel=0.01)
    made.box((1.4, 0.22, 0.02), (0, 0, -0.005), "lamp_cold")
    for x in (-0.6, 0.6):
        made.rod((x, 0, 0.08), (x, 0, 0.60), 0.008, "machine_grey")
    return made


def safety_barrier(name: str, length_m: float) -> Builder:
    """A low yellow rail along x that guards the end of a rack."""
    made = Builder(name)
    for x in (-0.5 * length_m, 0.5 * length_m):
        made.box((0.12, 0.12, 0.42), (x, 0, GAP_M + 0.21), "machine_yellow", bevel=0.01)
    made.box((length_m, 0.06, 0.14), (0, 0, 0.34), "machine_yellow", bevel=0.02)
    return made
