# SPDX-License-Identifier: Apache-2.0
"""The nearest of many Gaussians to each of many points on a GPU, where no tree is built.

Every distance is looked at, and none is written: a program keeps the least square so far in each of
`COLUMNS` lanes of a point. Twin: the tree of `nearest.nearest_gaussian`.
"""

from __future__ import annotations

import triton
import triton.language as tl

from rfgs_core.propagation.triton_math import three_rows

#: Points of a program, and Gaussians that it looks at together.
POINTS, COLUMNS = 32, 64


@triton.jit
def nearest_of(
    points, means, square, index, count, total, per_split,
    POINTS: tl.constexpr, COLUMNS: tl.constexpr,
):  # fmt: skip
    """Square distance to and row of the nearest Gaussian of a split, a row per split."""
    rows = tl.program_id(0) * POINTS + tl.arange(0, POINTS)
    there = rows < count
    px, py, pz = three_rows(points, rows, there, count, 0.0)
    first = tl.program_id(1) * per_split
    last = tl.minimum(first + per_split, total)
    best = tl.full((POINTS, COLUMNS), float("inf"), tl.float32)
    whose = tl.zeros((POINTS, COLUMNS), tl.int32)
    for start in range(first, last, COLUMNS):
        columns = start + tl.arange(0, COLUMNS)
        mx, my, mz = three_rows(means, columns, columns < last, total, float("inf"))
        dx = px[:, None] - mx[None, :]
        dy = py[:, None] - my[None, :]
        dz = pz[:, None] - mz[None, :]
        here = dx * dx + dy * dy + dz * dz
        whose = tl.where(here < best, columns[None, :], whose)
        best = tl.minimum(here, best)
    least = tl.min(best, axis=1)
    # Of equals the first.
    row = tl.min(tl.where(best == tl.expand_dims(least, 1), whose, total), axis=1)
    out = tl.program_id(1) * count + rows
    tl.store(square + out, least, there)
    tl.store(index + out, row, there)
