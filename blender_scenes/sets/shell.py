# SPDX-License-Identifier: GPL-3.0-or-later
"""The shell of a room: single sheets only, with windows and doors set back into the walls.

A wall of two sheets would reflect twice; a closing door would be lost to the ray tracer, which
needs a centimetre between sheets. So each wall is one sheet that steps back at its openings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import bpy

from blender_scenes.shapes import Builder, Point

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
    """Heights as shares of the hole; a row's surface wins unless the column has one."""
    frame: str = "white_wood"
    """Surface of the four reveals."""


def window(u: tuple[float, float], v: tuple[float, float], *, panes: int = 2) -> Opening:
    """A window of `panes` panes beside each other, between white frames."""
    frame = 0.03
    pane = (1.0 - frame * (panes + 1)) / panes
    columns = ((frame, "white_wood"), *(((pane, ""), (frame, "white_wood")) * panes))
    return Opening(
        u, v, 0.08, columns, ((0.04, "white_wood"), (0.92, "window_pane"), (0.04, "white_wood"))
    )


def door(
    u: tuple[float, float], *, height_m: float = 2.05, leaf: str = "door_wood", panel: str = ""
) -> Opening:
    """A door whose leaf has two panels; without `panel`, a plain leaf."""
    panel = panel or leaf
    columns = ((0.06, "white_wood"), (0.14, leaf), (0.60, ""), (0.14, leaf), (0.06, "white_wood"))
    rows = ((0.10, leaf), (0.32, panel), (0.08, leaf), (0.38, panel), (0.12, leaf))
    return Opening(u, (0.0, height_m), 0.04, columns, rows)


@dataclass(frozen=True)
class Wall:
    """One wall of a shell."""

    surface: str
    openings: tuple[Opening, ...] = ()
    """From the smallest u to the largest; they do not overlap."""
    lower: str = ""
    """Surface up to `lower_m`, where it differs."""
    lower_m: float = 0.0
    """Height of the lower part [m]."""


@dataclass(frozen=True)
class Shell:
    """A rectangular room, centred on x = y = 0, standing on z = 0."""

    size_m: tuple[float, float, float]
    south: Wall
    north: Wall
    east: Wall
    west: Wall
    floor: str = "oak_floor"
    ceiling: str = "ceiling_white"
    skirting: str = "white_wood"

    @property
    def half_m(self) -> tuple[float, float]:
        """Half its size along x and y [m]."""
        return self.size_m[0] / 2, self.size_m[1] / 2


def build_shell(
    shell: Shell, collection: bpy.types.Collection, floor: Builder | None = None
) -> list[bpy.types.Object]:
    """Builds floor, walls and ceiling; `floor` replaces the plain floor."""
    half_x, half_y = shell.half_m
    made = [(floor or _floor(shell)).build(collection, weld=True)]
    made += [build_side(shell, side, collection) for side in ("south", "north", "east", "west")]
    ceiling, height = Builder("ceiling"), shell.size_m[2]
    corners = [[(x, y, height) for x in (-half_x, half_x)] for y in (half_y, -half_y)]
    ceiling.sheet(corners, shell.ceiling)
    made.append(ceiling.build(collection))
    # A wire ceiling lets whoever opens the file look in from above; renders still see a sheet.
    made[-1].display_type = "WIRE"
    return made


def build_side(
    shell: Shell, side: str, collection: bpy.types.Collection, *, location: Point = (0.0, 0.0, 0.0)
) -> bpy.types.Object:
    """Builds one wall alone, as a front along a street; `location` is the room's middle [m]."""
    half_x, half_y = shell.half_m
    axis, offset, half = {
        "south": ("y", -half_y, half_x),
        "north": ("y", half_y, half_x),
        "east": ("x", half_x, half_y),
        "west": ("x", -half_x, half_y),
    }[side]
    sheet = _wall(shell, f"wall_{side}", getattr(shell, side), axis, offset, half)
    return sheet.build(collection, weld=True, location=location)


def build_partition(
    shell: Shell, name: str, wall: Wall, x: float, collection: bpy.types.Collection
) -> bpy.types.Object:
    """A wall across the room at `x` [m], one sheet for both of its sides."""
    sheet = _wall(shell, name, wall, "x", x, shell.half_m[1])
    return sheet.build(collection, weld=True)


def _floor(shell: Shell) -> Builder:
    half_x, half_y = shell.half_m
    floor = Builder("floor")
    rows = [[(x, y, 0.0) for x in (-half_x, half_x)] for y in (-half_y, half_y)]
    floor.sheet(rows, shell.floor)
    return floor


def _wall(shell: Shell, name: str, wall: Wall, axis: str, offset: float, half: float) -> Builder:
    """A wall across `axis` at `offset` [m]; its inner side faces the room."""
    sheet = Builder(name)
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
        sheet.sheet([[place(u, v, depth) for u in (first, last)] for v in vs], what)

    us = sorted({-half, half, *(u for hole in wall.openings for u in hole.u)})
    heights = {0.0, SKIRTING_M, wall.lower_m, shell.size_m[2]}
    vs = sorted(heights | {v for hole in wall.openings for v in hole.v})
    for u in pairwise(us):
        for v in pairwise(vs):
            if any(_within(hole, u, v) for hole in wall.openings):
                continue
            what = wall.lower if v[1] <= wall.lower_m else wall.surface
            rectangle(u, v, shell.skirting if v[1] <= SKIRTING_M else what, 0.0)
    for hole in wall.openings:
        _fill(sheet, hole, rectangle, place)
    return sheet


def _within(hole: Opening, u: tuple[float, float], v: tuple[float, float]) -> bool:
    along = hole.u[0] <= u[0] and u[1] <= hole.u[1]
    return along and hole.v[0] <= v[0] and v[1] <= hole.v[1]


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
        wall.sheet(ring, hole.frame)
