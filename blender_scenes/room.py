# SPDX-License-Identifier: GPL-3.0-or-later
"""The shell of the room: single sheets only, with a recessed window and door."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import bpy

from blender_scenes.shapes import Builder, Point

#: Inner size of the room [m]; it is centred on x = y = 0 and stands on z = 0.
SIZE_M = (6.0, 5.0, 2.7)
SKIRTING_M = 0.09


@dataclass(frozen=True)
class Opening:
    """A hole in a wall, in the wall's own axes: u along it, v up [m]."""

    u: tuple[float, float]
    v: tuple[float, float]
    recess: float
    """How far the filling lies behind the wall [m]."""
    columns: tuple[tuple[float, str], ...]
    """Widths as shares of the hole, and the surface of each column."""
    rows: tuple[tuple[float, str], ...]
    """Heights as shares of the hole; a row's surface wins unless it is ''."""


#: Frame and mullions are strips of the same sheet as the panes.
WINDOW = Opening(
    u=(-1.25, 0.55),
    v=(0.85, 2.20),
    recess=0.08,
    columns=(
        (0.03, "white_wood"),
        (0.455, ""),
        (0.03, "white_wood"),
        (0.455, ""),
        (0.03, "white_wood"),
    ),
    rows=((0.04, "white_wood"), (0.92, "window_pane"), (0.04, "white_wood")),
)
DOOR = Opening(
    u=(-1.75, -0.85),
    v=(0.0, 2.05),
    recess=0.04,
    columns=(
        (0.06, "white_wood"),
        (0.14, "door_wood"),
        (0.60, ""),
        (0.14, "door_wood"),
        (0.06, "white_wood"),
    ),
    rows=(
        (0.10, "door_wood"),
        (0.32, "door_panel"),
        (0.08, "door_wood"),
        (0.38, "door_panel"),
        (0.12, "door_wood"),
    ),
)


def build_room(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Builds floor, ceiling and the four walls."""
    half_x, half_y, height = SIZE_M[0] / 2, SIZE_M[1] / 2, SIZE_M[2]
    walls = [
        _wall("wall_south", half_x, "wall_accent", "y", -half_y, None),
        _wall("wall_north", half_x, "wall_outer", "y", half_y, None),
        _wall("wall_east", half_y, "wall_outer", "x", half_x, WINDOW),
        _wall("wall_west", half_y, "wall_paint", "x", -half_x, DOOR),
    ]
    ceiling = Builder("ceiling")
    corners = [[(x, y, height) for x in (-half_x, half_x)] for y in (half_y, -half_y)]
    ceiling.sheet(corners, "ceiling_white")
    made = [_floor(half_x, half_y).build(collection, weld=True)]
    made += [wall.build(collection, weld=True) for wall in walls]
    made.append(ceiling.build(collection))
    # A wire ceiling lets whoever opens the file look in from above; renders still see a sheet.
    made[-1].display_type = "WIRE"
    return made


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


def _wall(
    name: str, half: float, surface: str, axis: str, offset: float, hole: Opening | None
) -> Builder:
    """A wall across `axis` at `offset` [m]; its inner side faces the room."""
    wall = Builder(name)
    inward = -1.0 if offset > 0 else 1.0

    def place(u: float, v: float, depth: float = 0.0) -> Point:
        across = offset - inward * depth
        return (across, u, v) if axis == "x" else (u, across, v)

    def rectangle(
        us: tuple[float, float], vs: tuple[float, float], what: str, depth: float
    ) -> None:
        # Point order makes the normal look into the room.
        flip = (axis == "x") == (inward > 0)
        first, last = us if flip else us[::-1]
        wall.sheet([[place(u, v, depth) for u in (first, last)] for v in vs], what)

    us = [-half, half] if hole is None else [-half, *hole.u, half]
    vs = sorted({0.0, SKIRTING_M, SIZE_M[2], *(hole.v if hole else ())})
    for u in pairwise(us):
        for v in pairwise(vs):
            if hole and u == hole.u and hole.v[0] <= v[0] and v[1] <= hole.v[1]:
                continue
            rectangle(u, v, "white_wood" if v[1] <= SKIRTING_M else surface, 0.0)
    if hole:
        _fill(wall, hole, rectangle, place)
    return wall


def _fill(
    wall: Builder, hole: Opening, rectangle: Callable[..., None], place: Callable[..., Point]
) -> None:
    """Closes a hole with its panes and the four reveals that lead to them."""
    u = hole.u[0]
    for width, column in hole.columns:
        v, u_end = hole.v[0], u + width * (hole.u[1] - hole.u[0])
        for height, row in hole.rows:
            v_end = v + height * (hole.v[1] - hole.v[0])
            rectangle((u, u_end), (v, v_end), column or row, hole.recess)
            v = v_end
        u = u_end
    (left, right), (low, high) = hole.u, hole.v
    corners = [(left, low), (right, low), (right, high), (left, high)]
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        ring = [
            [place(*start), place(*end)],
            [place(*start, hole.recess), place(*end, hole.recess)],
        ]
        wall.sheet(ring, "white_wood")
