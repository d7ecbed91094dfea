# SPDX-License-Identifier: GPL-3.0-or-later
"""Desks, screens and shelves of offices and laboratories; fronts look along local +y."""

from __future__ import annotations

import math

from blender_scenes.shapes import Builder

#: Gap between a piece and the floor or a wall [m]: nearer sheets would be taken for one.
GAP_M = 0.012


def desk(name: str, width_m: float = 1.5, depth_m: float = 0.75) -> Builder:
    """A white desk top on a black metal frame; who works there sits on the +y side."""
    table = Builder(name)
    table.box((width_m, depth_m, 0.028), (0, 0, 0.726), "desk_top", bevel=0.006, segments=2)
    x, y = width_m / 2 - 0.06, depth_m / 2 - 0.08
    for side in (-x, x):
        for edge in (-y, y):
            table.box((0.05, 0.05, 0.69), (side, edge, 0.36), "black_metal", bevel=0.004)
        table.box((0.05, 2 * y, 0.03), (side, 0, 0.05), "black_metal", bevel=0.004)
    table.box((2 * x, 0.018, 0.32), (0, -y + 0.05, 0.52), "desk_panel", bevel=0.003)
    return table


def screen(name: str) -> Builder:
    """A monitor on its foot, with a keyboard before it; it looks along +y."""
    item = Builder(name)
    item.box((0.60, 0.03, 0.35), (0, 0, 0.31), "black_metal", bevel=0.006)
    item.box((0.57, 0.012, 0.32), (0, 0.020, 0.312), "screen_on")
    item.box((0.05, 0.03, 0.16), (0, -0.03, 0.10), "black_metal", bevel=0.004)
    item.box((0.22, 0.16, 0.014), (0, -0.02, 0.02), "black_metal", bevel=0.004)
    item.box((0.42, 0.13, 0.016), (0, 0.24, 0.02), "black_metal", bevel=0.004)
    return item


def office_chair(name: str, seat_m: float = 0.46) -> Builder:
    """A swivel chair on a five-armed foot, its seat `seat_m` above the floor [m]."""
    chair = Builder(name)
    chair.box((0.48, 0.46, 0.07), (0, 0.02, seat_m - 0.035), "chair_cloth", bevel=0.03, segments=3)
    chair.box(
        (0.44, 0.06, 0.50),
        (0, -0.25, seat_m + 0.36),
        "chair_cloth",
        bevel=0.025,
        segments=3,
        tilt=(0.12, 0, 0),
    )
    chair.box((0.07, 0.03, 0.30), (0, -0.235, seat_m + 0.06), "black_metal", bevel=0.004)
    chair.rod((0, 0, seat_m - 0.07), (0, 0, 0.09), 0.028, "black_metal")
    for arm in range(5):
        angle = 2 * math.pi * arm / 5 + 0.3
        tip = (0.30 * math.cos(angle), 0.30 * math.sin(angle), 0.055)
        chair.rod((0, 0, 0.10), tip, 0.022, "black_metal", taper=0.6)
        chair.rod((tip[0], tip[1], 0.055), (tip[0], tip[1], GAP_M), 0.026, "black_metal")
    return chair


def filing_cabinet(name: str, drawers: int = 4) -> Builder:
    """A metal cabinet with `drawers` drawers."""
    cabinet = Builder(name)
    height = 0.32 * drawers
    cabinet.box((0.46, 0.56, height), (0, 0, GAP_M + height / 2), "cabinet_metal", bevel=0.006)
    for drawer in range(drawers):
        z = GAP_M + 0.32 * (drawer + 0.5)
        cabinet.box((0.42, 0.015, 0.285), (0, 0.30, z), "cabinet_metal", bevel=0.004)
        cabinet.box((0.14, 0.02, 0.016), (0, 0.32, z + 0.07), "black_metal", bevel=0.003)
    return cabinet


def whiteboard(name: str, width_m: float = 1.8) -> Builder:
    """A framed board that hangs with its back towards local -y; z = 0 is its lower edge."""
    board = Builder(name)
    board.box((width_m, 0.012, 1.05), (0, 0, 0.525), "board_white", bevel=0.003)
    board.box((0.6 * width_m, 0.06, 0.015), (0, 0.035, 0.02), "cabinet_metal", bevel=0.003)
    for index, (x, z, length, ink) in enumerate(
        [
            (-0.5, 0.82, 0.5, "ink_blue"),
            (-0.42, 0.70, 0.66, "ink_blue"),
            (-0.55, 0.58, 0.4, "ink_blue"),
            (0.45, 0.78, 0.36, "ink_red"),
            (0.52, 0.62, 0.50, "ink_red"),
            (0.40, 0.40, 0.28, "ink_blue"),
        ]
    ):
        tilt = (0.0, 0.06 * (index % 3 - 1), 0.0)
        board.box((length, 0.003, 0.018), (x, 0.019, z), ink, tilt=tilt)
    return board


def shelf_rack(name: str, width_m: float = 1.2) -> Builder:
    """An open metal rack with boxes and instruments on it."""
    rack = Builder(name)
    for x in (-width_m / 2, width_m / 2):
        for y in (-0.2, 0.2):
            rack.box((0.035, 0.035, 1.85), (x, y, GAP_M + 0.925), "cabinet_metal")
    for level, z in enumerate((0.12, 0.62, 1.12, 1.62)):
        rack.box((width_m, 0.42, 0.02), (0, 0, z), "cabinet_metal")
        x = -width_m / 2 + 0.08
        for index in range(4):
            share = (0.618034 * (index + 5 * level)) % 1.0
            wide, high = 0.16 + 0.12 * share, 0.16 + 0.2 * ((2.7 * share) % 1.0)
            if x + wide > width_m / 2 - 0.04:
                break
            what = ("box_card", "desk_panel", "book_blue", "box_card")[(index + level) % 4]
            rack.box(
                (wide, 0.3, high), (x + wide / 2, 0.01, z + 0.022 + high / 2), what, bevel=0.005
            )
            x += wide + 0.04
    return rack


def bin_(name: str) -> Builder:
    """A waste-paper basket."""
    basket = Builder(name)
    basket.lathe(
        [(0.11, 0.0), (0.145, 0.30), (0.135, 0.30)], (0, 0, GAP_M), "black_metal", caps=False
    )
    return basket
