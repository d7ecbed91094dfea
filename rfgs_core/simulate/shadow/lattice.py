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

from rfgs_core.simulate.shadow.fresnel import add_fresnel

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
    table: np.ndarray,
    runs: np.ndarray,
    heights: np.ndarray,
    shifts: np.ndarray,
    counts: tuple[int, int],
    per_m: np.ndarray,
) -> np.ndarray:
    """Kirchhoff factors T of a silhouette for the elements of arrays at some frequencies.

    Args:
        table: `FRESNEL`.
        runs: Runs of the silhouette [m], shape (N, 2).
        heights: Rows of the runs [m], shape (N, 2).
        shifts: Where the line of each pair of elements crosses the plane [m], rows x and y, shape
            (2, pair).
        counts: Places along x and along y, see `places_needed`.
        per_m: Fresnel coordinate per metre at each frequency, √(2 s/λ), shape (frequency,).

    Returns:
        Factors on the amplitudes, complex128, shape (pair, frequency); 1 without a silhouette.
    """
    at_x, of_x = _axis(shifts[0], counts[0])
    at_y, of_y = _axis(shifts[1], counts[1])
    real, imaginary = _on_lattice(table, runs, heights, at_x, at_y, per_m)
    factors = np.zeros((shifts.shape[1], len(per_m)), dtype=np.complex128)
    for e in range(shifts.shape[1]):
        for c in range(len(per_m)):
            re, im = 0.0, 0.0
            for y in range(len(at_y)):
                row_re, row_im = 0.0, 0.0
                for x in range(len(at_x)):
                    row_re += of_x[e, x] * real[c, y, x]
                    row_im += of_x[e, x] * imaginary[c, y, x]
                re += of_y[e, y] * row_re
                im += of_y[e, y] * row_im
            factors[e, c] = 1.0 - 0.5j * complex(re, im)
    return factors


@numba.njit(cache=True)
def _axis(shift: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev nodes over the range of some shifts, and what each shift takes of each node.

    Barycentric form; Berrut and Trefethen, SIAM Review 46 (2004), equation 5.3.

    Args:
        shift: Shifts along the axis [m], shape (pair,).
        count: Number of nodes.

    Returns:
        Nodes [m], shape (node,), and weights, shape (pair, node).
    """
    low, high = shift.min(), shift.max()
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-12)
    at, sign = np.zeros(count), np.zeros(count)
    for n in range(count):
        angle = (2 * n + 1) * math.pi / (2 * count)
        at[n] = math.cos(angle)
        sign[n] = math.sin(angle) * (1.0 if n % 2 == 0 else -1.0)
    weights = np.zeros((len(shift), count))
    for e in range(len(shift)):
        place = (shift[e] - middle) / half
        total, node = 0.0, -1
        for n in range(count):
            away = place - at[n]
            if abs(away) < 1e-13:
                node = n
                break
            weights[e, n] = sign[n] / away
            total += weights[e, n]
        if node >= 0:
            weights[e] = 0.0
            weights[e, node] = 1.0
        else:
            weights[e] /= total
    return middle + half * at, weights


@numba.njit(cache=True)
def _on_lattice(
    table: np.ndarray,
    runs: np.ndarray,
    heights: np.ndarray,
    at_x: np.ndarray,
    at_y: np.ndarray,
    per_m: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """The double Fresnel integral over runs, real and imaginary, each (frequency, y, x)."""
    n_x, n_y = len(at_x), len(at_y)
    shift_x, per_m_x = _spread(at_x, per_m)
    shift_y, per_m_y = _spread(at_y, per_m)
    real = np.zeros((len(per_m), n_y, n_x))
    imaginary = np.zeros_like(real)
    across, before = np.zeros((2, len(shift_x))), np.zeros((2, len(shift_x)))
    along = np.zeros((2, len(shift_y)))
    for i in range(len(runs) + 1):
        ended = i == len(runs)
        if i > 0 and (ended or heights[i, 0] != heights[i - 1, 0]):
            # The integral over y of each row is a difference of two values, so that a boundary
            # between rows takes one value, times how the rows differ.
            _add_boundary(
                table, heights[i - 1, 0], shift_y, per_m_y, before - across, along, real, imaginary
            )
            before[:] = across
            across[:] = 0.0
            if ended or heights[i, 0] != heights[i - 1, 1]:
                _add_boundary(
                    table, heights[i - 1, 1], shift_y, per_m_y, before, along, real, imaginary
                )
                before[:] = 0.0
        if not ended:
            add_fresnel(table, runs[i, 1], shift_x, per_m_x, 1.0, across)
            add_fresnel(table, runs[i, 0], shift_x, per_m_x, -1.0, across)
    return real, imaginary


@numba.njit(cache=True)
def _spread(at: np.ndarray, per_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every place at every frequency: shifts and Fresnel coordinates per metre, frequency first."""
    shift, scale = np.zeros(len(at) * len(per_m)), np.zeros(len(at) * len(per_m))
    for line in range(len(shift)):
        shift[line] = at[line % len(at)]
        scale[line] = per_m[line // len(at)]
    return shift, scale


@numba.njit(cache=True, fastmath={"contract", "nsz"})
def _add_boundary(
    table: np.ndarray,
    edge: float,
    shift_y: np.ndarray,
    per_m_y: np.ndarray,
    more: np.ndarray,
    along: np.ndarray,
    real: np.ndarray,
    imaginary: np.ndarray,
) -> None:
    """Adds F at the boundary of two rows times what the lower one has more; `along` is scratch."""
    along[:] = 0.0
    add_fresnel(table, edge, shift_y, per_m_y, 1.0, along)
    n_y, n_x = real.shape[1], real.shape[2]
    for c in range(real.shape[0]):
        for y in range(n_y):
            a, b = along[0, c * n_y + y], along[1, c * n_y + y]
            for x in range(n_x):
                re, im = more[0, c * n_x + x], more[1, c * n_x + x]
                real[c, y, x] += a * re - b * im
                imaginary[c, y, x] += a * im + b * re
