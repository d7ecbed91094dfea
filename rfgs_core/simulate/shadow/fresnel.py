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

from rfgs_core.vector_math import sine_cosine_of_turns

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

_NONE, _HALF, _QUARTER = np.float32(0.0), np.float32(0.5), np.float32(0.25)
_ONE, _TWO, _BEND = np.float32(1.0), np.float32(2.0), np.float32(0.6)
#: f and g over [0, 30] by powers of t = 2/(1 + 0.6 ν) − 1, fitted to SciPy's integrals.
_F0, _F1, _F2 = (np.float32(v) for v in (0.185294275, 0.334076929, 0.198830534))
_F3, _F4, _F5 = (np.float32(v) for v in (-0.0311475211, -0.198891249, -0.111905921))
_F6, _F7, _F8 = (np.float32(v) for v in (0.0931789084, 0.0843068715, -0.039357314))
_F9, _F10 = np.float32(-0.0256192777), np.float32(0.011226589)
_G0, _G1, _G2 = (np.float32(v) for v in (0.019130182, 0.0993392888, 0.220564546))
_G3, _G4, _G5 = (np.float32(v) for v in (0.246734243, 0.0758028769, -0.134334125))
_G6, _G7, _G8 = (np.float32(v) for v in (-0.112668685, 0.0484870714, 0.0613936225))
_G9, _G10 = np.float32(-0.0103375671), np.float32(-0.0141175795)


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "nsz"})
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


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def fill_fresnel(edges: np.ndarray, shift: float, per_m: float, out: np.ndarray) -> None:
    """F((edge − shift) · per_m) of many edges by polynomials, errors below 1e-5, in vector code.

    With the auxiliary functions f and g (Abramowitz and Stegun 1964, 7.3.9 and 7.3.10)
    F = (1 − j)/2 + (f + j g) sin(πν²/2) + (j f − g) cos(πν²/2); both are smooth in 1/(1 + 0.6 ν).

    Args:
        edges: Edges [m], float32, shape (edge,).
        shift: Place that they are seen from [m].
        per_m: Fresnel coordinate per metre.
        out: Filled, real and imaginary, float32, shape (2, edge).
    """
    at, scale, end = np.float32(shift), np.float32(per_m), np.float32(_TABLE_END)
    real, imaginary = out[0], out[1]
    for e in range(len(edges)):
        nu = (edges[e] - at) * scale
        size = abs(nu) if abs(nu) < end else end
        t = _TWO / (_ONE + _BEND * size) - _ONE
        f = _F10 * t + _F9
        f = ((f * t + _F8) * t + _F7) * t + _F6
        f = ((f * t + _F5) * t + _F4) * t + _F3
        f = ((f * t + _F2) * t + _F1) * t + _F0
        g = _G10 * t + _G9
        g = ((g * t + _G8) * t + _G7) * t + _G6
        g = ((g * t + _G5) * t + _G4) * t + _G3
        g = ((g * t + _G2) * t + _G1) * t + _G0
        turns = _QUARTER * size * size
        sine, cosine = sine_cosine_of_turns(turns - np.floor(turns + _HALF))
        re = f * sine - g * cosine if size < end else _NONE
        im = f * cosine + g * sine if size < end else _NONE
        real[e] = _HALF + re if nu > _NONE else -_HALF - re
        imaginary[e] = im - _HALF if nu > _NONE else _HALF - im


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
