# SPDX-License-Identifier: GPL-3.0-or-later
"""The sheet metal of cars and vans: cross-sections along x, joined into one closed skin.

A section is a ring of twelve points: from the middle of the floor over sill, door, belt line and
window up to the middle of the roof, and down again on the other side. Panes, lamps and grille are
faces of the same skin, so no two sheets lie close to each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from blender_scenes.shapes import Builder, Point

#: A line over x: (x, value) in ascending order of x [m].
Line = Sequence[tuple[float, float]]
Span = tuple[float, float]

#: Bands of a section from the floor up, between neighbouring points of the ring.
FLOOR, SILL, DOOR, EDGE, WINDOW, ROOF = range(6)
_ARCH_STEPS = 8
#: Lines across the front and the back, as shares of the half width.
_COLUMNS = (-1.0, -0.6, -0.3, 0.3, 0.6, 1.0)


@dataclass(frozen=True)
class Shape:
    """Outline of a body; the rear axle stands at x = 0."""

    bottom: Line
    """Lower edge [m]."""
    belt: Line
    """Lower edge of the windows [m]."""
    top: Line
    """Outline along the middle: bonnet, windscreen, roof, rear [m]."""
    half_belt: Line
    """Half width at the belt line [m]."""
    half_top: Line
    """Half width at the edge of roof and bonnet [m]."""
    crown_m: float
    """How far the roof bulges above its edge [m]."""
    axles: tuple[float, float]
    """Where the wheel arches are [m]."""
    arch_m: float
    """Radius of the wheel arches [m]."""
    hub_m: float
    """Height of the hubs [m]."""
    side_panes: tuple[Span, ...]
    """Windows of the sides [m]."""
    sloping_panes: tuple[Span, ...]
    """Windscreen and rear window [m]."""

    def stations(self) -> list[float]:
        """Where the sections are [m]."""
        lines = (self.bottom, self.belt, self.top, self.half_belt, self.half_top)
        places = {x for line in lines for x, _ in line}
        places |= {x for span in (*self.side_panes, *self.sloping_panes) for x in span}
        for axle in self.axles:
            turns = (math.pi * step / _ARCH_STEPS for step in range(_ARCH_STEPS + 1))
            places |= {axle + self.arch_m * math.cos(turn) for turn in turns}
        rounded = sorted({round(place, 4) for place in places})
        # Two sections closer than 3 cm would only make slivers; panes keep their edges.
        edges = {x for span in (*self.side_panes, *self.sloping_panes) for x in span}
        edges |= {rounded[0], rounded[-1]}
        kept = [rounded[0]]
        for place in rounded[1:]:
            if place - kept[-1] >= 0.03:
                kept.append(place)
            elif place in edges and kept[-1] not in edges:
                kept[-1] = place
        return kept

    def ring(self, x: float) -> list[tuple[float, float]]:
        """The seven points (half width, height) [m] of the left half of the section at `x`."""
        bottom, belt, top = (_at(line, x) for line in (self.bottom, self.belt, self.top))
        for axle in self.axles:
            inside = self.arch_m**2 - (x - axle) ** 2
            if inside > 0:
                bottom = max(bottom, self.hub_m + math.sqrt(inside))
        wide, roof = _at(self.half_belt, x), _at(self.half_top, x)
        edge = min(belt + 0.02, top - 0.02)
        return [
            (0.0, bottom),
            (wide - 0.05, bottom),
            (wide, bottom + 0.45 * (belt - bottom)),
            (wide - 0.012, belt),
            (wide - 0.05, edge),
            (min(roof, wide - 0.07), max(top - self.crown_m, edge + 0.006)),
            (0.0, top),
        ]


#: Surface of a face: by band and the x [m] of both its ends.
Paint = Callable[[int, float, float], str]
#: Surface of a face of the front or back: by band and column, from the right 0 to the left 4.
EndPaint = Callable[[int, int], str]


def add_body(builder: Builder, shape: Shape, paint: Paint, rear: EndPaint, front: EndPaint) -> None:
    """Adds the closed skin of a body to `builder`."""
    stations = shape.stations()
    points: list[Point] = []
    for x in stations:
        half = shape.ring(x)
        points += [(x, y, z) for y, z in half]
        points += [(x, -y, z) for y, z in half[5:0:-1]]
    faces: list[list[int]] = []
    surfaces: list[str] = []
    for index, (x0, x1) in enumerate(pairwise(stations)):
        for corner in range(12):
            after, here, there = (corner + 1) % 12, 12 * index, 12 * index + 12
            faces.append([here + corner, there + corner, there + after, here + after])
            band = corner if corner < 6 else 11 - corner
            surfaces.append(paint(band, x0, x1))
    for ring, x, end in ((0, stations[0], rear), (len(stations) - 1, stations[-1], front)):
        _close(points, faces, surfaces, (12 * ring, shape.ring(x), x), end)
    builder.polygons(points, faces, surfaces)


def pane_paint(shape: Shape, panes: str, otherwise: Paint) -> Paint:
    """Glass where the shape has panes, `otherwise` elsewhere."""

    def paint(band: int, x0: float, x1: float) -> str:
        middle = 0.5 * (x0 + x1)
        spans = {WINDOW: shape.side_panes, ROOF: shape.sloping_panes}.get(band, ())
        if any(low <= middle <= high for low, high in spans):
            return panes
        return otherwise(band, x0, x1)

    return paint


def _close(
    points: list[Point],
    faces: list[list[int]],
    surfaces: list[str],
    section: tuple[int, list[tuple[float, float]], float],
    paint: EndPaint,
) -> None:
    """Closes one end with a flat grid of faces between the sill and the roof's edge."""
    first, half, x = section
    rows = []
    for level in range(1, 6):
        wide, height = half[level]
        inner = range(len(points), len(points) + len(_COLUMNS) - 2)
        points += [(x, share * wide, height) for share in _COLUMNS[1:-1]]
        rows.append([first + 12 - level, *inner, first + level])
    for band, (low, high) in enumerate(pairwise(rows), start=SILL):
        for column in range(len(_COLUMNS) - 1):
            after = column + 1
            faces.append([low[column], low[after], high[after], high[column]])
            surfaces.append(paint(band, column))
    faces.append([*rows[-1], first + 6])
    surfaces.append(paint(ROOF, 2))
    faces.append([*reversed(rows[0]), first])
    surfaces.append(paint(FLOOR, 2))


def _at(line: Line, x: float) -> float:
    return float(np.interp(x, *zip(*line, strict=True)))
