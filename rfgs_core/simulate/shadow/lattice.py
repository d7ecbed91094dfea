# SPDX-License-Identifier: Apache-2.0
"""The shadow on every antenna element of an array, from few places in its plane.

Elements of an array see a silhouette from slightly different places. Moved by δ, an edge at
Fresnel coordinate ν turns by π ν δ, so that over the few centimetres of an array its share of the
factor is a polynomial of about that degree in δ. The integrand separates in x and y: on a lattice
of nx × ny places each row of the silhouette takes Fresnel integrals at nx + ny places only. The
factors at the elements are the polynomials through the lattice. The plain twin is
`fresnel.screen_factors`, which takes every element by itself.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from rfgs_core.simulate.shadow.fresnel import fill_fresnel

#: Places along one axis at most; beyond that elements are taken one by one.
MOST_PLACES = 32
#: Arrays that turn no edge by more than this [rad] see the shadow from one place.
_STILL_RAD = 1e-3


@numba.njit(cache=True)
def places_needed(half_m: float, farthest_m: float, per_m: float) -> int:
    """How many places along one axis tell the shadow anywhere on it.

    Args:
        half_m: Half of the length of the axis [m].
        farthest_m: Distance of the farthest edge within bounds from anywhere on the axis [m].
        per_m: Highest Fresnel coordinate per metre, √(2 s/λ).
    """
    degree = math.pi * per_m * per_m * farthest_m * half_m
    if degree < _STILL_RAD:
        return 1
    # Bessel functions J_n(degree) are the Chebyshev coefficients. Far edges, which turn fastest,
    # are 1/(√2 π ν) of the path: J_n may be the larger.
    return math.ceil(degree + np.cbrt(degree) + 2.0)


@numba.njit(cache=True)
def lattice_factors(
    runs: np.ndarray,
    heights: np.ndarray,
    shifts: np.ndarray,
    counts: tuple[int, int],
    per_m: np.ndarray,
) -> np.ndarray:
    """Kirchhoff factors T of a silhouette for the elements of arrays at some frequencies.

    Args:
        runs: Runs of the silhouette [m], shape (N, 2).
        heights: Rows of the runs [m], shape (N, 2).
        shifts: Where the line of each pair of elements crosses the plane [m], rows x and y, shape
            (2, pair).
        counts: Places along x and along y, see `places_needed`.
        per_m: Fresnel coordinate per metre at each frequency, √(2 s/λ), shape (frequency,).

    Returns:
        Factors on the amplitudes less 1, real and imaginary, shape (2, frequency, pair); 0 without
        a silhouette.
    """
    at_x, of_x = _axis(shifts[0], counts[0])
    at_y, of_y = _axis(shifts[1], counts[1])
    lattice = _on_lattice(runs, heights, at_x, at_y, per_m)
    change = np.zeros((2, len(per_m), shifts.shape[1]))
    row = np.zeros((2, shifts.shape[1]))
    for c in range(len(per_m)):
        for y in range(len(at_y)):
            row[:] = 0.0
            for x in range(len(at_x)):
                _add_scaled(of_x[x], lattice[0, c, y, x], lattice[1, c, y, x], row[0], row[1])
            # −j/2 times the integral.
            _add_product(of_y[y], row[1], 0.5, change[0, c])
            _add_product(of_y[y], row[0], -0.5, change[1, c])
    return change


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "nsz"})
def _add_scaled(
    weight: np.ndarray, re: float, im: float, real: np.ndarray, imaginary: np.ndarray
) -> None:
    """Adds a number, each pair with its weight."""
    for e in range(len(weight)):
        real[e] += weight[e] * re
        imaginary[e] += weight[e] * im


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "nsz"})
def _add_product(weight: np.ndarray, row: np.ndarray, scale: float, out: np.ndarray) -> None:
    """Adds rows times weights, pair by pair."""
    for e in range(len(weight)):
        out[e] += scale * weight[e] * row[e]


@numba.njit(cache=True, error_model="numpy")
def _axis(shift: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev nodes over the range of some shifts, and what each shift takes of each node.

    Barycentric form; Berrut and Trefethen, SIAM Review 46 (2004), equation 5.3.

    Args:
        shift: Shifts along the axis [m], shape (pair,).
        count: Number of nodes.

    Returns:
        Nodes [m], shape (node,), and weights, shape (node, pair).
    """
    low, high = shift.min(), shift.max()
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-12)
    at = np.zeros(count)
    weights, total = np.zeros((count, len(shift))), np.zeros(len(shift))
    for n in range(count):
        angle = (2 * n + 1) * math.pi / (2 * count)
        at[n] = math.cos(angle)
        sign = math.sin(angle) * (1.0 if n % 2 == 0 else -1.0)
        row = weights[n]
        for e in range(len(shift)):
            away = (shift[e] - middle) / half - at[n]
            # So near that nothing of the other nodes is left.
            away = away if abs(away) > 1e-15 else 1e-15
            row[e] = sign / away
            total[e] += row[e]
    for e in range(len(shift)):
        total[e] = 1.0 / total[e]
    for n in range(count):
        row = weights[n]
        for e in range(len(shift)):
            row[e] *= total[e]
    return middle + half * at, weights


@numba.njit(cache=True)
def _on_lattice(
    runs: np.ndarray,
    heights: np.ndarray,
    at_x: np.ndarray,
    at_y: np.ndarray,
    per_m: np.ndarray,
) -> np.ndarray:
    """The double Fresnel integral over runs, real and imaginary, shape (2, frequency, y, x).

    The integral over y of each row is a difference of two values, so that each level between rows
    takes one value, times what the runs below it have more than those above.
    """
    levels, lower, upper = _levels_of(heights)
    starts, ends = runs[:, 0].astype(np.float32), runs[:, 1].astype(np.float32)
    out = np.zeros((2, len(per_m), len(at_y), len(at_x)))
    from_start = np.zeros((2, len(runs)), dtype=np.float32)
    to_end = np.zeros_like(from_start)
    along = np.zeros((2, len(levels)), dtype=np.float32)
    more = np.zeros((len(at_x), 2, len(levels)), dtype=np.float32)
    for c in range(len(per_m)):
        more[:] = 0.0
        for x in range(len(at_x)):
            fill_fresnel(starts, at_x[x], per_m[c], from_start)
            fill_fresnel(ends, at_x[x], per_m[c], to_end)
            for i in range(len(runs)):
                re, im = to_end[0, i] - from_start[0, i], to_end[1, i] - from_start[1, i]
                more[x, 0, upper[i]] += re
                more[x, 1, upper[i]] += im
                more[x, 0, lower[i]] -= re
                more[x, 1, lower[i]] -= im
        for y in range(len(at_y)):
            fill_fresnel(levels, at_y[y], per_m[c], along)
            for x in range(len(at_x)):
                out[0, c, y, x], out[1, c, y, x] = _product_sum(along, more[x])
    return out


@numba.njit(cache=True)
def _levels_of(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Levels at which rows of runs end [m], float32, and which lies below and above each run.

    Args:
        heights: Rows of the runs, from the lowest [m], shape (N, 2).
    """
    levels = np.zeros(2 * len(heights), dtype=np.float32)
    lower, upper = np.zeros(len(heights), np.uint64), np.zeros(len(heights), np.uint64)
    count = 0
    for i in range(len(heights)):
        if i == 0 or heights[i, 0] != heights[i - 1, 0]:
            if i == 0 or heights[i, 0] != heights[i - 1, 1]:
                levels[count] = heights[i, 0]
                count += 1
            levels[count] = heights[i, 1]
            count += 1
        lower[i], upper[i] = count - 2, count - 1
    return levels[:count], lower, upper


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "nsz", "reassoc"})
def _product_sum(a: np.ndarray, b: np.ndarray) -> tuple[np.float32, np.float32]:
    """Sum of products of complex numbers, given as rows real and imaginary."""
    a_re, a_im, b_re, b_im = a[0], a[1], b[0], b[1]
    re, im = np.float32(0.0), np.float32(0.0)
    for i in range(len(a_re)):
        re += a_re[i] * b_re[i] - a_im[i] * b_im[i]
        im += a_re[i] * b_im[i] + a_im[i] * b_re[i]
    return re, im
