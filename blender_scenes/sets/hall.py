# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands and hangs in corridors and halls; pieces look along local +y."""

from __future__ import annotations

from blender_scenes.shapes import Builder

GAP_M = 0.012


def bench(name: str, length_m: float = 1.5) -> Builder:
    """A slatted wooden bench on metal legs."""
    seat = Builder(name)
    for y in (-0.15, -0.05, 0.05, 0.15):
        seat.box((length_m, 0.085, 0.03), (0, y, 0.45), "oak", bevel=0.006, segments=2)
    for x in (-length_m / 2 + 0.18, length_m / 2 - 0.18):
        seat.box((0.05, 0.36, 0.03), (x, 0, 0.405), "black_metal", bevel=0.004)
        for y in (-0.15, 0.15):
            seat.box((0.05, 0.03, 0.37), (x, y, GAP_M + 0.19), "black_metal", bevel=0.004)
    return seat


def lockers(name: str, count: int = 4) -> Builder:
    """A row of tall metal lockers on a plinth."""
    row = Builder(name)
    wide = 0.38
    row.box((count * wide, 0.42, 0.08), (0, 0, GAP_M + 0.04), "black_metal")
    for index in range(count):
        x = (index - (count - 1) / 2) * wide
        paint = ("locker_blue", "locker_grey")[index % 2]
        row.box((wide - 0.008, 0.45, 1.75), (x, 0, 0.98), paint, bevel=0.008)
        for slot in range(3):
            row.box((0.18, 0.008, 0.012), (x, 0.232, 1.62 + 0.04 * slot), "black_metal")
        row.box((0.02, 0.03, 0.12), (x + 0.13, 0.245, 1.02), "black_metal", bevel=0.003)
    return row


def notice_board(name: str, width_m: float = 1.4) -> Builder:
    """A cork board with sheets pinned to it; z = 0 is its lower edge."""
    board = Builder(name)
    board.box((width_m, 0.02, 0.9), (0, 0, 0.45), "cork", bevel=0.004)
    papers = ("paper_white", "paint_teal", "paper_white", "book_ochre", "paper_white", "paint_rust")
    for index, paper in enumerate(papers):
        x = -width_m / 2 + 0.2 + (index % 3) * (width_m - 0.4) / 2
        z = 0.26 + 0.38 * (index // 3) + 0.03 * ((index * 2) % 3 - 1)
        tilt = (0.0, 0.08 * ((index % 3) - 1), 0.0)
        board.box((0.21, 0.003, 0.29), (x, 0.024, z), paper, tilt=tilt)
    return board


def extinguisher(name: str) -> Builder:
    """A fire extinguisher that hangs on the wall behind it."""
    item = Builder(name)
    item.lathe(
        [(0.05, 0.0), (0.075, 0.02), (0.075, 0.40), (0.05, 0.46), (0.02, 0.49)],
        (0, 0, 0),
        "fire_red",
        sides=16,
    )
    item.rod((0, 0, 0.49), (0, 0, 0.54), 0.022, "black_metal")
    item.rod((0, 0, 0.53), (0, 0.10, 0.50), 0.012, "black_metal")
    return item


def exit_sign(name: str) -> Builder:
    """A lit sign that hangs below the ceiling."""
    sign = Builder(name)
    sign.box((0.40, 0.03, 0.18), (0, 0, 0), "sign_green", bevel=0.006)
    sign.box((0.16, 0.006, 0.05), (-0.04, 0.022, 0.0), "paper_white")
    return sign


def planter(name: str, length_m: float = 0.9) -> Builder:
    """A long box of low green leaves."""
    box = Builder(name)
    box.box((length_m, 0.34, 0.42), (0, 0, GAP_M + 0.21), "planter_grey", bevel=0.012, segments=2)
    count = int(length_m / 0.09)
    for index in range(3 * count):
        x = ((index % count) + 0.5) / count * (length_m - 0.1) - (length_m - 0.1) / 2
        y = 0.1 * (index // count - 1)
        lean = 0.5 * (((0.618034 * index) % 1.0) - 0.5)
        high = 0.22 + 0.2 * ((0.754878 * index) % 1.0)
        tip = (x + lean * high, y + 0.3 * lean, 0.45 + high)
        wide = 0.028
        box.sheet(
            [
                [(x - wide, y, 0.445), (x + wide, y, 0.445)],
                [
                    (x - 0.8 * wide + 0.4 * lean * high, y, 0.45 + 0.55 * high),
                    (x + 0.8 * wide + 0.4 * lean * high, y, 0.45 + 0.55 * high),
                ],
                [(tip[0] - 0.004, tip[1], tip[2]), (tip[0] + 0.004, tip[1], tip[2])],
            ],
            "leaf",
        )
    return box


def column(name: str, height_m: float, side_m: float = 0.32) -> Builder:
    """A concrete column that ends a centimetre below the ceiling."""
    post = Builder(name)
    high = height_m - 2 * GAP_M
    post.box((side_m, side_m, high), (0, 0, GAP_M + high / 2), "wall_outer", bevel=0.02)
    post.box((side_m + 0.03, side_m + 0.03, 0.12), (0, 0, GAP_M + 0.06), "planter_grey", bevel=0.01)
    return post


def stairs(name: str, steps: int, rise_m: float, run_m: float, width_m: float) -> Builder:
    """Steps that rise along +y from y = 0, one box each, with a brass nosing."""
    flight = Builder(name)
    for step in range(steps):
        high = rise_m * (step + 1) - GAP_M
        y = run_m * (step + 0.5)
        flight.box((width_m, run_m - 0.001, high), (0, y, GAP_M + high / 2), "stone", bevel=0.006)
        flight.box(
            (width_m - 0.04, 0.04, 0.006),
            (0, run_m * step + 0.035, rise_m * (step + 1) + 0.004),
            "brass",
        )
    return flight


def landing(name: str, size: tuple[float, float, float]) -> Builder:
    """A platform of width x, depth y and height z, standing on y = 0 to depth."""
    block = Builder(name)
    high = size[2] - GAP_M
    block.box((size[0], size[1], high), (0, size[1] / 2, GAP_M + high / 2), "stone", bevel=0.006)
    return block


def railing(name: str, length_m: float, rise: float = 0.0) -> Builder:
    """A handrail along +y that climbs `rise` metres per metre."""
    rail = Builder(name)
    posts = max(2, round(length_m / 0.6) + 1)
    for post in range(posts):
        y = length_m * post / (posts - 1)
        z = rise * y
        rail.rod((0, y, z + 0.02), (0, y, z + 0.92), 0.016, "black_metal")
    rail.rod(
        (0, -0.05, 0.93 - 0.05 * rise),
        (0, length_m + 0.05, 0.93 + rise * (length_m + 0.05)),
        0.024,
        "oak",
    )
    return rail
