# SPDX-License-Identifier: GPL-3.0-or-later
"""Fronts of houses and shops: one sheet each, with windows and doors set back."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from blender_scenes.sets.shell import Opening, Shell, Wall, build_side
from blender_scenes.shapes import Builder

Span = tuple[float, float]


def glazing(u: Span, v: Span, glass: str, frame: str, *, panes: int = 2) -> Opening:
    """A window or shop front of `panes` panes; u along the wall from its middle, v up [m]."""
    bar = min(0.07 / (u[1] - u[0]), 0.1)
    pane = (1.0 - bar * (panes + 1)) / panes
    columns = ((bar, frame), *(((pane, ""), (bar, frame)) * panes))
    return Opening(u, v, 0.12, columns, ((0.04, frame), (0.92, glass), (0.04, frame)), frame)


@dataclass(frozen=True)
class Front:
    """The front of one building."""

    name: str
    x_m: Span
    """From where to where it runs along the street."""
    height_m: float
    wall: Wall
    """Its openings count from the middle of the front."""


def build_front(
    front: Front, side: str, y_m: float, collection: bpy.types.Collection
) -> bpy.types.Object:
    """Builds a front at `y_m`; the `north` side looks south, the `south` side north."""
    west, east = front.x_m
    plain = Wall(front.wall.surface)
    walls = {"south": plain, "north": plain, side: front.wall}
    shell = Shell(
        (east - west, 2 * abs(y_m), front.height_m),
        walls["south"],
        walls["north"],
        plain,
        plain,
        skirting="kerb_stone",
    )
    made = build_side(shell, side, collection, location=(0.5 * (west + east), 0.0, 0.0))
    made.name = made.data.name = front.name
    return made


def awning(name: str, width_m: float, depth_m: float) -> Builder:
    """A striped awning along x that slopes down towards −y; its upper edge lies at y = 0."""
    made = Builder(name)
    count = max(4, round(width_m / 0.3))
    for index in range(count):
        x0, x1 = (width_m * (share / count - 0.5) for share in (index, index + 1))
        surface = ("awning_red", "awning_cream")[index % 2]
        rows = [
            [(x0, -depth_m, -0.62), (x1, -depth_m, -0.62)],
            [(x0, -depth_m, -0.42), (x1, -depth_m, -0.42)],
            [(x0, -0.02, 0.0), (x1, -0.02, 0.0)],
        ]
        made.sheet(rows, surface)
    return made


def sign(name: str, width_m: float, board: str, letters: int) -> Builder:
    """A shop sign with a row of light strokes for letters; it looks along −y."""
    made = Builder(name)
    made.box((width_m, 0.08, 0.55), (0, 0, 0), board, bevel=0.02)
    step = 0.7 * width_m / letters
    for index in range(letters):
        x = (index - 0.5 * (letters - 1)) * step
        tall = (0.30, 0.22, 0.30, 0.26)[index % 4]
        made.box((0.06, 0.03, tall), (x - 0.18 * step, -0.055, 0.0), "line_white")
        if index % 3 != 1:
            made.box(
                (0.45 * step, 0.03, 0.06),
                (x + 0.05 * step, -0.055, 0.5 * tall - 0.03),
                "line_white",
            )
        if index % 2 == 0:
            made.box((0.40 * step, 0.03, 0.06), (x + 0.03 * step, -0.055, -0.02), "line_white")
    return made
