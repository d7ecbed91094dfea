# SPDX-License-Identifier: Apache-2.0
"""Fresnel integral over a silhouette that is cut into rows.

In Fresnel coordinates ν = ρ √(2 s/λ) the Kirchhoff factor of a screen is
T = 1 − (j/2) ∬ e^{−jπν²/2} d²ν. The integrand separates in x and y, so a silhouette that is
cut into rows needs the one-dimensional Fresnel integral at the ends of its runs only.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from scipy.special import fresnel

_TABLE_END = 30.0
_TABLE_PER_UNIT = 512


def _fresnel_table() -> np.ndarray:
    """F(ν) = ∫_0^ν e^{−jπt²/2} dt for ν ≥ 0 as rows real, imaginary; the limit at the end."""
    nu = np.arange(int(_TABLE_END * _TABLE_PER_UNIT) + 2) / _TABLE_PER_UNIT
    sine, cosine = fresnel(nu)
    table = np.stack([cosine, -sine])
    table[:, -2:] = [[0.5], [-0.5]]
    return table


FRESNEL = _fresnel_table()


@numba.njit(cache=True, fastmath={"contract", "nsz"})
def add_fresnel(
    table: np.ndarray,
    edge: float,
    shift: np.ndarray,
    per_m: np.ndarray,
    sign: float,
    out: np.ndarray,
) -> None:
    """Adds sign · F((edge − shift) · per_m) for many shifts; `out` holds real and imaginary."""
    last = table.shape[1] - 2
    for e in range(len(shift)):
        nu = (edge - shift[e]) * per_m[e]
        place = min(abs(nu) * _TABLE_PER_UNIT, last - 0.0)
        i = np.int32(place)
        share = place - i
        signed = math.copysign(sign, nu) if sign > 0.0 else -math.copysign(sign, nu)
        out[0, e] += signed * (table[0, i] + (table[0, i + 1] - table[0, i]) * share)
        out[1, e] += signed * (table[1, i] + (table[1, i + 1] - table[1, i]) * share)


@numba.njit(cache=True)
def _add_boundary(
    table: np.ndarray,
    edge: float,
    shift: np.ndarray,
    per_m: np.ndarray,
    below: np.ndarray,
    above: np.ndarray,
    at: np.ndarray,
    total: np.ndarray,
) -> None:
    """Adds F at the boundary of two rows times what the lower one has more; `at` is scratch."""
    at[:] = 0.0
    add_fresnel(table, edge, shift, per_m, 1.0, at)
    for e in range(len(total)):
        re, im = below[0, e] - above[0, e], below[1, e] - above[1, e]
        total[e] += complex(at[0, e] * re - at[1, e] * im, at[0, e] * im + at[1, e] * re)


@numba.njit(cache=True)
def screen_factors(
    table: np.ndarray, runs: np.ndarray, heights: np.ndarray, shifts: np.ndarray, per_m: np.ndarray
) -> np.ndarray:
    """Kirchhoff factors T of a silhouette for lines through its plane, each at its frequency.

    Args:
        table: `FRESNEL`.
        runs: Runs of the silhouette [m], shape (N, 2).
        heights: Rows of the runs [m], shape (N, 2).
        shifts: Where each line crosses the plane [m], rows x and y, shape (2, line).
        per_m: Fresnel coordinate per metre for each line, √(2 s/λ), shape (line,).

    Returns:
        Factors on the amplitudes, complex128, shape (line,); 1 without a silhouette.
    """
    # The integral over y of each row is a difference of two values, so that each boundary
    # between rows takes one value, times how the rows differ.
    total = np.zeros(shifts.shape[1], dtype=np.complex128)
    shape = (2, shifts.shape[1])
    across, before, at = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for i in range(len(runs) + 1):
        first = i == 0 or i == len(runs) or heights[i, 0] != heights[i - 1, 0]
        if first and i > 0:
            _add_boundary(table, heights[i - 1, 0], shifts[1], per_m, before, across, at, total)
            before, across = across, before
            across[:] = 0.0
            if i == len(runs) or heights[i, 0] != heights[i - 1, 1]:
                _add_boundary(table, heights[i - 1, 1], shifts[1], per_m, before, across, at, total)
                before[:] = 0.0
        if i < len(runs):
            add_fresnel(table, runs[i, 1], shifts[0], per_m, 1.0, across)
            add_fresnel(table, runs[i, 0], shifts[0], per_m, -1.0, across)
    return 1.0 - 0.5j * total
