# SPDX-License-Identifier: GPL-3.0-or-later
"""Where each piece of the living room stands.

Everything keeps at least 12 mm from walls and floor: nearer, the ray tracer would take two
sheets for one.
"""

from __future__ import annotations

import math

import bpy

from blender_scenes.sets.decoration import build_decoration
from blender_scenes.sets.seating import armchair, chair, cushion, sofa
from blender_scenes.shapes import Builder

#: Gap between a piece of furniture and the floor or a wall [m].
GAP_M = 0.012

_BOOKS = ("book_red", "book_cream", "book_blue", "book_ochre", "book_green")


def build_furniture(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Builds and places all furniture; returns the objects."""
    pieces = [
        sofa().build(collection, location=(0.0, -2.0, 0.0)),
        cushion("cushion_rust").build(collection, location=(-0.72, -2.08, 0.62)),
        cushion("cushion_sand").build(collection, location=(0.70, -2.08, 0.62), yaw=0.1),
        armchair().build(collection, location=(-2.1, 1.72, 0.0), yaw=math.radians(225)),
        coffee_table().build(collection, location=(0.0, -1.02, 0.0)),
        tv_unit().build(collection, location=(-0.05, 2.25, 0.0)),
        television().build(collection, location=(-0.05, 2.27, 0.56)),
        bookshelf().build(collection, location=(-2.82, 0.62, 0.0), yaw=math.radians(90)),
        books().build(collection, location=(-2.82, 0.62, 0.0), yaw=math.radians(90)),
        dining_table().build(collection, location=(1.95, 1.50, 0.0)),
    ]
    for index, (x, y, degrees) in enumerate(
        [(1.65, 1.03, 184), (2.25, 1.03, 177), (1.66, 2.00, -6), (2.24, 1.98, 3)], start=1
    ):
        pieces.append(
            chair(f"chair_{index}").build(
                collection, location=(x, y, 0.0), yaw=math.radians(degrees)
            )
        )
    return pieces + build_decoration(collection)


def coffee_table() -> Builder:
    """A low oak table with a shelf, a book and a bowl."""
    table = Builder("coffee_table")
    table.box((1.05, 0.55, 0.035), (0, 0, 0.40), "oak", bevel=0.008, segments=2)
    table.box((0.92, 0.44, 0.02), (0, 0, 0.16), "oak", bevel=0.004)
    for x in (-0.47, 0.47):
        for y in (-0.23, 0.23):
            table.box((0.045, 0.045, 0.37), (x, y, 0.197), "black_metal", bevel=0.004)
    table.box((0.24, 0.17, 0.03), (-0.25, 0.05, 0.436), "book_blue", bevel=0.003)
    table.box((0.20, 0.15, 0.025), (-0.24, 0.05, 0.465), "book_cream", bevel=0.003)
    bowl = [(0.05, 0.0), (0.09, 0.03), (0.12, 0.075), (0.108, 0.075), (0.06, 0.022)]
    table.lathe(bowl, (0.22, -0.02, 0.42), "terracotta", sides=20)
    return table


def tv_unit() -> Builder:
    """A walnut sideboard on legs with three doors."""
    unit = Builder("tv_unit")
    unit.box((1.60, 0.40, 0.38), (0, 0, 0.35), "walnut", bevel=0.006, segments=2)
    for x in (-0.525, 0.0, 0.525):
        unit.box((0.505, 0.02, 0.32), (x, -0.21, 0.35), "oak", bevel=0.004)
        unit.box((0.10, 0.015, 0.012), (x, -0.228, 0.475), "brass", bevel=0.003)
    for x in (-0.70, 0.70):
        for y in (-0.14, 0.14):
            unit.rod((x, y, 0.165), (x * 1.04, y * 1.1, GAP_M + 0.006), 0.022, "brass", taper=0.7)
    return unit


def television() -> Builder:
    """A flat television on two feet."""
    tv = Builder("television")
    tv.box((1.18, 0.035, 0.68), (0, 0, 0.40), "black_metal", bevel=0.006)
    tv.box((1.15, 0.012, 0.645), (0, -0.02, 0.403), "tv_screen")
    for x in (-0.36, 0.36):
        tv.box((0.03, 0.22, 0.015), (x, -0.01, 0.008), "black_metal", bevel=0.003)
        tv.box((0.03, 0.025, 0.07), (x, 0.0, 0.04), "black_metal")
    return tv


_SHELF_WIDTH_M, _SHELF_DEPTH_M, _SHELF_HEIGHT_M = 1.10, 0.30, 1.92
_SHELVES_Z = (0.08, 0.46, 0.82, 1.18, 1.54)


def bookshelf() -> Builder:
    """A tall open shelf with a back; its front looks along local -y."""
    shelf = Builder("bookshelf")
    inner = _SHELF_WIDTH_M - 0.05
    for x in (-0.5, 0.5):
        shelf.box(
            (0.025, _SHELF_DEPTH_M, _SHELF_HEIGHT_M - GAP_M),
            (x * (_SHELF_WIDTH_M - 0.025), 0, (_SHELF_HEIGHT_M + GAP_M) / 2),
            "oak",
            bevel=0.003,
        )
    for z in (*_SHELVES_Z, _SHELF_HEIGHT_M - 0.0125):
        shelf.box((inner, _SHELF_DEPTH_M - 0.02, 0.025), (0, -0.005, z), "oak", bevel=0.003)
    shelf.box((inner, 0.015, 1.86), (0, 0.14, 0.99), "white_wood")
    return shelf


def books() -> Builder:
    """Books, a vase and boxes on the bookshelf, always in the same disorder."""
    shelf = Builder("books")
    for level, z in enumerate(_SHELVES_Z):
        x = -0.50 + 0.13 * (level % 3)
        for index in range(9 + 2 * (level % 2)):
            # Low-discrepancy steps look random and need no random numbers.
            wobble = (0.618034 * (index + 11 * level)) % 1.0
            width, height = 0.022 + 0.022 * wobble, 0.19 + 0.08 * ((3.7 * wobble) % 1.0)
            shelf.box(
                (width, 0.17, height),
                (x + width / 2, -0.01, z + 0.0125 + height / 2),
                _BOOKS[(index * 3 + level) % 5],
            )
            x += width + 0.002
    vase = [(0.045, 0.0), (0.075, 0.06), (0.07, 0.13), (0.03, 0.19), (0.04, 0.22)]
    shelf.lathe(vase, (0.36, -0.02, _SHELVES_Z[3] + 0.013), "terracotta")
    shelf.lathe(vase, (0.30, -0.02, _SHELVES_Z[1] + 0.013), "paper_white")
    shelf.box((0.26, 0.2, 0.17), (0.34, -0.01, _SHELVES_Z[0] + 0.10), "book_cream", bevel=0.01)
    return shelf


def dining_table() -> Builder:
    """An oak table for four with a bowl of fruit."""
    table = Builder("dining_table")
    table.box((1.25, 0.78, 0.035), (0, 0, 0.735), "oak", bevel=0.01, segments=2)
    table.box((1.07, 0.60, 0.06), (0, 0, 0.685), "oak", bevel=0.004)
    for x in (-0.53, 0.53):
        for y in (-0.30, 0.30):
            table.rod((x, y, 0.71), (x * 1.05, y * 1.08, GAP_M + 0.006), 0.034, "oak", taper=0.6)
    bowl = [(0.06, 0.0), (0.12, 0.04), (0.15, 0.09), (0.138, 0.09), (0.08, 0.03)]
    table.lathe(bowl, (0, 0, 0.755), "paper_white", sides=20)
    for angle in (0.3, 2.4, 4.5):
        ball = [(0.012, 0.0), (0.034, 0.018), (0.040, 0.04), (0.034, 0.062), (0.012, 0.078)]
        place = (0.055 * math.cos(angle), 0.055 * math.sin(angle), 0.80)
        table.lathe(ball, place, "paint_rust", sides=12)
    return table
