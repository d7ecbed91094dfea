# SPDX-License-Identifier: Apache-2.0
"""Which splats nearer ones hide: level of detail that leaves a picture as it is.

A splat has at least a variance of 0.3 px² and keeps its opacity, however far away it is. One of
opacity o takes 2π · 0.3 (o − 1/255) pixels of light, faint parts not counted, so that behind n of
them per pixel at most exp(−2π · 0.3 n (o − 1/255)) is left: `LIGHT_MIN` at ten for o = 0.6, and at
four hundred for o = 0.02. Of a crowd that is small in a picture only the nearest are seen. To draw
few of it is therefore to leave out those behind, not to draw several as one: one Gaussian with the
moments of many has another rim and another colour in front (`docs/log.md` has figures).

What is left out would have met less light than `LIGHT_MIN` at every pixel that it reaches. At each
pixel shares of what comes later add up to what is lit, so all of it together changes colours by at
most this share of the brightest.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from rfgs_core.vector_math import FAST_REDUCTION

#: Splats are left out where less light than this passes, and a tile is finished when that is
#: everywhere.
LIGHT_MIN = 1e-5
#: Added to a splat's reach, as a share of it and in pixels: more than rounding, so that whatever
#: the exponent finds within reach is in the span.
REACH_MARGIN = 1e-3

_OPTIONS: Any = {"fastmath": FAST_REDUCTION, "cache": True, "error_model": "numpy"}


@numba.njit(inline="always", **_OPTIONS)
def span(splat: np.ndarray, axis: int, corner: int, size: int) -> tuple[int, int]:
    """First and one-past-last pixel from a corner on that a splat may reach, within a size.

    Axis 0 is along columns, 1 along rows.
    """
    a, b, c = splat[2], splat[3], splat[4]
    half = np.sqrt(2.0 * splat[6] * (a if axis else c) / (a * c - b * b))
    half += REACH_MARGIN * (1.0 + half)
    middle = splat[axis] - corner - 0.5
    # Cut before they are whole numbers, which hold no splat of any size.
    first = min(max(np.ceil(middle - half), 0.0), float(size))
    last = min(max(np.floor(middle + half) + 1.0, first), float(size))
    return int(first), int(last)


@numba.njit(inline="always", **_OPTIONS)
def is_hidden(
    light: np.ndarray,  # [H * W], row after row
    width: int,
    splat: np.ndarray,  # [7]
    rows: tuple[int, int],  # as of `span`
    corner: tuple[int, int],  # column and row of the first pixel
) -> bool:
    """Whether less than `LIGHT_MIN` passes wherever a splat reaches.

    The first lit pixel settles it, so those in sight cost little.
    """
    first, last = span(splat, 0, corner[0], width)
    for row in range(rows[0], rows[1]):
        dy = row + corner[1] + 0.5 - splat[1]
        for column in range(first, last):
            if light[row * width + column] >= LIGHT_MIN:
                dx = column + corner[0] + 0.5 - splat[0]
                power = (0.5 * splat[2] * dx + splat[3] * dy) * dx + 0.5 * splat[4] * dy * dy
                if power <= splat[6]:
                    return False
    return True


@numba.njit(parallel=True, **_OPTIONS)
def mark_in_sight(
    shown: np.ndarray,  # [R], written
    light: np.ndarray,  # [H, W], what nearer ones let pass
    splats: np.ndarray,  # [M, 7]
    rows: np.ndarray,  # [R], those that are asked about
) -> None:
    """Marks the splats that are not hidden in the whole picture."""
    height, width = light.shape
    flat = light.reshape(height * width)
    for index in numba.prange(len(rows)):
        splat = splats[rows[index]]
        reached = span(splat, 1, 0, height)
        shown[index] = not is_hidden(flat, width, splat, reached, (0, 0))
