# SPDX-License-Identifier: GPL-3.0-or-later
"""The shell of the living room: an east window, a west door, a rug let into the boards."""

from __future__ import annotations

import bpy

from blender_scenes.sets.shell import Shell, Wall, build_shell, door, window
from blender_scenes.shapes import Builder

SHELL = Shell(
    size_m=(6.0, 5.0, 2.7),
    south=Wall("wall_accent"),
    north=Wall("wall_outer"),
    east=Wall("wall_outer", (window((-1.25, 0.55), (0.85, 2.20)),)),
    west=Wall("wall_paint", (door((-1.75, -0.85), panel="door_panel"),)),
)


def build_room(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Builds floor, ceiling and the four walls."""
    return build_shell(SHELL, collection, _floor(*SHELL.half_m))


def _floor(half_x: float, half_y: float) -> Builder:
    """Boards with the rug let into them, so that the floor stays one sheet."""
    floor = Builder("floor")
    xs = [-half_x, -1.5, -1.42, 1.42, 1.5, half_x]
    ys = [-half_y, -1.75, -1.67, -0.23, -0.15, half_y]
    for column in range(5):
        for row in range(5):
            rug = column in (1, 2, 3) and row in (1, 2, 3)
            border = column in (1, 3) or row in (1, 3)
            surface = "oak_floor" if not rug else "rug_border" if border else "rug"
            low, high = ys[row], ys[row + 1]
            left, right = xs[column], xs[column + 1]
            floor.sheet(
                [[(left, low, 0), (right, low, 0)], [(left, high, 0), (right, high, 0)]], surface
            )
    return floor
