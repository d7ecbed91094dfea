# SPDX-License-Identifier: Apache-2.0
"""Kernels of the tiled rasteriser: splats to pictures, and gradients of pictures to splats.

Threads share tiles, never a sum: results are the same bytes for any number of threads.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from rfgs_core.render.hidden import LIGHT_MIN, is_hidden, span
from rfgs_core.render.splat import ALPHA_MAX, TILE_PX
from rfgs_core.vector_math import FAST_REDUCTION, exponential

#: Splats after which a tile is looked at again.
_LOOK_EVERY = 16

#: A contribution a at its largest is this multiple of what it leaves, a / (1 − a); a little less.
_LARGEST_ODDS = 0.999999 * ALPHA_MAX / (1.0 - ALPHA_MAX)
#: Stands for the light behind so many splats that nothing is left of it.
_NO_LIGHT = 1e-300

_OPTIONS: Any = {"fastmath": FAST_REDUCTION, "cache": True, "error_model": "numpy"}


@numba.njit(inline="always", **_OPTIONS)
def _tile_corner(tile: int, width: int, height: int) -> tuple[int, int, int, int]:
    """First and one-past-last column and row of a tile."""
    columns = (width + TILE_PX - 1) // TILE_PX
    left, top = (tile % columns) * TILE_PX, (tile // columns) * TILE_PX
    return left, min(width, left + TILE_PX), top, min(height, top + TILE_PX)


@numba.njit(inline="always", **_OPTIONS)
def _take_light(
    light: np.ndarray,  # [TILE_PX * TILE_PX], row after row
    share: np.ndarray,  # [TILE_PX * TILE_PX]
    splat: np.ndarray,
    rows: tuple[int, int],
    left: int,
    top: int,
) -> None:
    """Writes the share that a splat gives to the pixels of these rows, and takes it from the light.

    No branch, so that a row of a tile is a few vectors. The exponent is in double whatever the
    precision of the share: whether it is within reach is what the plain twin finds too.
    """
    real = share.dtype.type
    x, half_a, b, reach = splat[0] - left - 0.5, 0.5 * splat[2], splat[3], splat[6]
    opacity, most = real(splat[5]), real(ALPHA_MAX)
    for row in range(rows[0], rows[1]):
        dy = row + top + 0.5 - splat[1]
        by_row, along = 0.5 * splat[4] * dy * dy, b * dy
        pixels = slice(row * TILE_PX, (row + 1) * TILE_PX)
        lit, given = light[pixels], share[pixels]
        for column in range(TILE_PX):
            dx = column - x
            power = (half_a * dx + along) * dx + by_row
            alpha = opacity * exponential(real(-power))
            alpha = min(alpha, most) * real(power <= reach)
            given[column] = lit[column] * alpha
            lit[column] -= given[column]


@numba.njit(inline="always", **_OPTIONS)
def _is_finished(drawn: int, light: np.ndarray) -> bool:
    """Whether no pixel of a tile passes `LIGHT_MIN` any more, looked at every few splats."""
    if drawn % _LOOK_EVERY != _LOOK_EVERY - 1:
        return False
    most = light[0]
    for pixel in range(TILE_PX * TILE_PX):
        most = max(most, light[pixel])
    return most < LIGHT_MIN


@numba.njit(inline="always", **_OPTIONS)
def _add(sums: np.ndarray, share: np.ndarray, values: np.ndarray, rows: tuple[int, int]) -> None:
    """Adds what a splat gives to rows of a tile: its values, then its share itself."""
    channels = len(values)
    for channel in range(channels + 1):
        total = sums[channel]
        value = values[channel] if channel < channels else sums.dtype.type(1.0)
        for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
            total[pixel] += share[pixel] * value


@numba.njit(parallel=True, **_OPTIONS)
def blend(
    picture: np.ndarray,  # [H, W, C + 1]: values, then the share that is covered
    values: np.ndarray,  # [S, C]
    splats: np.ndarray,  # [S, 7]
    starts: np.ndarray,  # [T + 1]
    entries: np.ndarray,  # [E]
) -> None:
    """Draws a picture, tile by tile."""
    height, width, channels = picture.shape
    for tile in numba.prange(len(starts) - 1):
        left, right, top, bottom = _tile_corner(tile, width, height)
        light = np.ones(TILE_PX * TILE_PX, values.dtype)
        share = np.zeros(TILE_PX * TILE_PX, values.dtype)
        sums = np.zeros((channels, TILE_PX * TILE_PX), values.dtype)
        for entry in range(starts[tile], starts[tile + 1]):
            if _is_finished(entry - starts[tile], light):
                break
            splat = splats[entries[entry]]
            rows = span(splat, 1, top, TILE_PX)
            if is_hidden(light, TILE_PX, splat, rows, (left, top)):
                continue
            _take_light(light, share, splat, rows, left, top)
            _add(sums, share, values[entries[entry]], rows)
        for row in range(top, bottom):
            for column in range(left, right):
                picture[row, column] = sums[:, (row - top) * TILE_PX + column - left]


@numba.njit(inline="always", **_OPTIONS)
def _slopes_of_tile(tile: int, towards: np.ndarray) -> tuple[int, int, np.ndarray]:
    """First column and row of a tile, and its part of a gradient, [C, TILE_PX * TILE_PX]."""
    height, width, channels = towards.shape
    left, right, top, bottom = _tile_corner(tile, width, height)
    slopes = np.zeros((channels, TILE_PX * TILE_PX), towards.dtype)
    for channel in range(channels):
        for row in range(top, bottom):
            for column in range(left, right):
                pixel = (row - top) * TILE_PX + column - left
                slopes[channel, pixel] = towards[row, column, channel]
    return left, top, slopes


@numba.njit(parallel=True, **_OPTIONS)
def value_shares(
    shares: np.ndarray,  # [E, C], zero on entry
    towards: np.ndarray,  # [H, W, C], gradient with respect to the picture
    splats: np.ndarray,  # [S, 7]
    starts: np.ndarray,  # [T + 1]
    entries: np.ndarray,  # [E]
) -> None:
    """What each entry of a tile adds to the gradient of its splat's values."""
    channels = towards.shape[2]
    for tile in numba.prange(len(starts) - 1):
        left, top, slopes = _slopes_of_tile(tile, towards)
        light = np.ones(TILE_PX * TILE_PX, towards.dtype)
        share = np.zeros(TILE_PX * TILE_PX, towards.dtype)
        for entry in range(starts[tile], starts[tile + 1]):
            if _is_finished(entry - starts[tile], light):
                break
            splat = splats[entries[entry]]
            rows = span(splat, 1, top, TILE_PX)
            if is_hidden(light, TILE_PX, splat, rows, (left, top)):
                continue
            _take_light(light, share, splat, rows, left, top)
            for channel in range(channels):
                total, slope = towards.dtype.type(0.0), slopes[channel]
                for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
                    total += share[pixel] * slope[pixel]
                shares[entry, channel] = total


@numba.njit(inline="always", **_OPTIONS)
def _weigh(
    worth: np.ndarray,  # [TILE_PX * TILE_PX]
    slopes: np.ndarray,  # [C + 1, TILE_PX * TILE_PX]
    values: np.ndarray,  # [C]
    rows: tuple[int, int],
) -> None:
    """What a unit of share of a splat with these values adds to the loss, at pixels of rows."""
    channels = len(values)
    for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
        worth[pixel] = slopes[channels, pixel]
    for channel in range(channels):
        slope, value = slopes[channel], values[channel]
        for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
            worth[pixel] += slope[pixel] * value


@numba.njit(inline="always", **_OPTIONS)
def _pull(
    out: np.ndarray,  # [6]
    pulls: np.ndarray,  # [TILE_PX * TILE_PX], a ∂L/∂a at each pixel
    splat: np.ndarray,
    rows: tuple[int, int],
    left: int,
    top: int,
) -> None:
    """Gradient of centre, inverse covariance and opacity from that of contributions a."""
    x, a, b, c = splat[0] - left - 0.5, splat[2], splat[3], splat[4]
    total, by_x, by_y, by_xx, by_xy, by_yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for row in range(rows[0], rows[1]):
        dy, pulled = row + top + 0.5 - splat[1], pulls[row * TILE_PX : (row + 1) * TILE_PX]
        zeroth, first, second = 0.0, 0.0, 0.0
        for column in range(TILE_PX):
            dx = column - x
            zeroth += pulled[column]
            first += pulled[column] * dx
            second += pulled[column] * dx * dx
        total, by_x, by_y = total + zeroth, by_x + first, by_y + dy * zeroth
        by_xx, by_xy, by_yy = by_xx + second, by_xy + dy * first, by_yy + dy * dy * zeroth
    out[0], out[1] = a * by_x + b * by_y, b * by_x + c * by_y
    out[2], out[3], out[4] = -0.5 * by_xx, -by_xy, -0.5 * by_yy
    out[5] = total / splat[5]


@numba.njit(parallel=True, **_OPTIONS)
def shape_shares(
    shares: np.ndarray,  # [E, 6], zero on entry
    towards: np.ndarray,  # [H, W, C + 1], gradient of the picture and of the share covered
    values: np.ndarray,  # [S, C]
    splats: np.ndarray,  # [S, 7]
    starts: np.ndarray,  # [T + 1]
    entries: np.ndarray,  # [E]
) -> None:
    """What each entry of a tile adds to the gradient of the first six columns of `splats`.

    With w_i the share of splat i, s_i what a unit of it adds to the loss and a_i its contribution,
    ∂L/∂a_i = (w_i s_i − a_i / (1 − a_i) Σ_{j > i} w_j s_j) / a_i (Kerbl et al. 2023). The sum over
    what lies behind is that over all, found by a first walk, less what has been passed, in double:
    little is left of it where the light is nearly gone.
    """
    for tile in numba.prange(len(starts) - 1):
        left, top, slopes = _slopes_of_tile(tile, towards)
        light, behind = np.ones(TILE_PX * TILE_PX), np.zeros(TILE_PX * TILE_PX)
        worth, pulls = np.zeros(TILE_PX * TILE_PX), np.zeros(TILE_PX * TILE_PX)
        share, end = np.zeros(TILE_PX * TILE_PX, towards.dtype), starts[tile + 1]
        for entry in range(starts[tile], starts[tile + 1]):
            if _is_finished(entry - starts[tile], light):
                end = entry
                break
            splat = splats[entries[entry]]
            rows = span(splat, 1, top, TILE_PX)
            if is_hidden(light, TILE_PX, splat, rows, (left, top)):
                continue
            _take_light(light, share, splat, rows, left, top)
            _weigh(worth, slopes, values[entries[entry]], rows)
            for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
                behind[pixel] += share[pixel] * worth[pixel]
        light[:] = 1.0
        for entry in range(starts[tile], end):
            splat = splats[entries[entry]]
            rows = span(splat, 1, top, TILE_PX)
            if is_hidden(light, TILE_PX, splat, rows, (left, top)):
                continue
            _take_light(light, share, splat, rows, left, top)
            _weigh(worth, slopes, values[entries[entry]], rows)
            for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
                own = share[pixel] * worth[pixel]
                behind[pixel] -= own
                odds = share[pixel] / max(light[pixel], _NO_LIGHT)
                # A contribution at its largest does not move with its splat.
                pulls[pixel] = (own - odds * behind[pixel]) * (odds < _LARGEST_ODDS)
            _pull(shares[entry], pulls, splat, rows, left, top)


@numba.njit(cache=True)
def sum_shares(
    total: np.ndarray,  # [S, C]
    shares: np.ndarray,  # [E, C]
    entries: np.ndarray,  # [E]
) -> None:
    """Adds what the entries of all tiles hold to their splats, always in the same order."""
    for entry in range(shares.shape[0]):
        for channel in range(shares.shape[1]):
            total[entries[entry], channel] += shares[entry, channel]
