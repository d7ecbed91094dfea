# SPDX-License-Identifier: Apache-2.0
"""What kernels for a GPU share: rows of tables, vectors, sines; `vector_math` on the CPU."""

from __future__ import annotations

import triton
import triton.language as tl


@triton.jit
def three_rows(table, row, mask, total, other):
    """Three rows of a table."""
    return (
        tl.load(table + row, mask, other=other),
        tl.load(table + total + row, mask, other=other),
        tl.load(table + 2 * total + row, mask, other=other),
    )


@triton.jit
def sine_cosine_of_turns(turns):
    """Sine and cosine of 2 pi `turns` in [-0.5, 0.5], as in `vector_math`: no branch, no table."""
    x = turns * turns
    s = -0.0070283 * x + 0.08205035
    s = s * x - 0.59925219
    s = s * x + 2.55016332
    s = s * x - 5.16771276
    s = (s * x + 3.14159265) * turns
    c = 1.83999059e-3 * x - 2.57763173e-2
    c = c * x + 0.235325437
    c = c * x - 1.33526232
    c = c * x + 4.05871211
    c = c * x - 4.93480220
    c = c * x + 1.0
    return 2.0 * s * c, 1.0 - 2.0 * s * s


@triton.jit
def plus(x, y, z, weight, ux, uy, uz):
    """A vector and a weighted one."""
    return x + weight * ux, y + weight * uy, z + weight * uz


@triton.jit
def store_three(out, row, mask, total, x, y, z):
    """Writes three rows of a table."""
    tl.store(out + row, x, mask)
    tl.store(out + total + row, y, mask)
    tl.store(out + 2 * total + row, z, mask)
