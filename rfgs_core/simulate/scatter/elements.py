# SPDX-License-Identifier: Apache-2.0
"""One facet as every element of an array sees it, in single precision and vector code."""

from __future__ import annotations

import math

import numba
import numpy as np

#: Facets damped by more than e^-12 are 100 dB weaker than they could be and are left out.
MOST_DAMPED = 12.0
#: Adding and taking away this rounds a single to whole numbers.
_ROUND = np.float32(12582912.0)
_HALF, _ONE, _TWO = np.float32(0.5), np.float32(1.0), np.float32(2.0)
_PI = np.float32(math.pi)
#: sin and cos of ±π/2 by their series, Taylor's with the last term fitted: errors below 1e-6.
_S3, _S5, _S7, _S9 = (np.float32(v) for v in (-1 / 6, 1 / 120, -1.9841e-4, 2.72e-6))
_C2, _C4, _C6, _C8 = (np.float32(v) for v in (-0.5, 1 / 24, -1.38887e-3, 2.46e-5))
_E3, _E4, _E5 = (np.float32(1.0 / v) for v in (6.0, 24.0, 120.0))
_SIXTEENTH = np.float32(-1.0 / 16.0)
_FAST = {"contract", "nsz", "ninf", "nnan"}


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def see_elements(
    to: tuple[float, float, float],
    centre_m: float,
    n: tuple[float, float, float],
    offsets: np.ndarray,
    turns: np.ndarray,
    seen: np.ndarray,
    phasor: np.ndarray,
) -> None:
    """What one facet sees of an array, beyond its centre.

    Args:
        to: Unit vector from the facet to the centre.
        centre_m: Distance of the centre [m].
        n: Its normal.
        offsets: Elements from the centre [m], and their squared distance from it [m²], float32,
            shape (4, element).
        turns: Turns per metre at the middle subcarrier, and at each node beyond that, (1 + node,).
        seen: Filled with unit vectors to the elements, their part along the normal, one over the
            distances, δ, and the phasor at the middle subcarrier, float32, shape (8, element).
        phasor: Filled with e^{−jkδ}, δ what each element is farther away than the centre, real
            and imaginary, float32, shape (node, 2, element).
    """
    centre = np.float32(centre_m)
    x, y, z = np.float32(to[0]) * centre, np.float32(to[1]) * centre, np.float32(to[2]) * centre
    nx, ny, nz = np.float32(n[0]), np.float32(n[1]), np.float32(n[2])
    centre_2 = centre * centre
    along = x * nx + y * ny + z * nz
    ox, oy, oz, o2 = offsets[0], offsets[1], offsets[2], offsets[3]
    s0, s1, s2, s3, s4 = seen[0], seen[1], seen[2], seen[3], seen[4]
    deltas, re, im = seen[5], seen[6], seen[7]
    if len(ox) == 1 and o2[0] == 0.0:
        # One element is its own centre.
        s0[0], s1[0], s2[0] = np.float32(to[0]), np.float32(to[1]), np.float32(to[2])
        s3[0], s4[0] = along / centre, _ONE / centre
        phasor[:, 0, 0], phasor[:, 1, 0] = _ONE, np.float32(0.0)
        return
    per_m = np.float32(turns[0])
    # Two loops: the compiler gives up telling whether more arrays overlap.
    for e in range(len(ox)):
        farther_2 = _TWO * (x * ox[e] + y * oy[e] + z * oz[e]) + o2[e]
        d = np.sqrt(centre_2 + farther_2)
        s4[e] = _ONE / d
        # The difference of two roots, without losing its digits.
        deltas[e] = farther_2 / (d + centre)
    for e in range(len(ox)):
        inverse = s4[e]
        s0[e], s1[e], s2[e] = (x + ox[e]) * inverse, (y + oy[e]) * inverse, (z + oz[e]) * inverse
        s3[e] = (along + nx * ox[e] + ny * oy[e] + nz * oz[e]) * inverse
    for e in range(len(ox)):
        turn = per_m * deltas[e]
        a = _PI * (turn - ((turn + _ROUND) - _ROUND))
        b = a * a
        s = a * (_ONE + b * (_S3 + b * (_S5 + b * (_S7 + b * _S9))))
        c = _ONE + b * (_C2 + b * (_C4 + b * (_C6 + b * _C8)))
        # sin and cos of 2a: at a = ±π/2 both series are at their worst, their product is not.
        re[e] = _ONE - _TWO * s * s
        im[e] = -_TWO * s * c
    for m in range(len(phasor)):
        _turn(np.float32(2.0 * math.pi * turns[1 + m]), deltas, (re, im), phasor[m])


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn(
    more: np.float32, deltas: np.ndarray, phasor: tuple[np.ndarray, np.ndarray], out: np.ndarray
) -> None:
    """Fills in phasors turned by a little more per metre; a function of its own, else scalar."""
    re, im, row_re, row_im = phasor[0], phasor[1], out[0], out[1]
    for e in range(len(deltas)):
        a = more * deltas[e]
        b = a * a
        s = a * (_ONE + b * (_S3 + b * _S5))
        c = _ONE + b * (_C2 + b * (_C4 + b * _C6))
        row_re[e] = re[e] * c + im[e] * s
        row_im[e] = im[e] * c - re[e] * s


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def exact_values(
    tx: np.ndarray,
    rx: np.ndarray,
    sent: np.ndarray,
    heard: np.ndarray,
    weight: complex,
    damping: float,
    out: np.ndarray,
) -> None:
    """Channel of one facet at one node between all pairs of elements.

    Args:
        tx: What the facet sees of the transmitting elements, see `see_elements`.
        rx: What it sees of the receiving ones.
        sent: Phasors of the transmitting elements, shape (2, tx).
        heard: Those of the receiving ones, shape (2, rx).
        weight: What all links have in common.
        damping: k² A / 24.
        out: Filled, real and imaginary, float32, shape (2, tx · rx).
    """
    r0, r1, r2, r3, r4 = rx[0], rx[1], rx[2], rx[3], rx[4]
    h_re, h_im = heard[0], heard[1]
    factor, most, none = np.float32(damping), np.float32(MOST_DAMPED), np.float32(0.0)
    count = len(r0)
    for t in range(tx.shape[1]):
        x, y, z, along = tx[0, t], tx[1, t], tx[2, t], tx[3, t]
        near = tx[4, t] if along > none else none
        part = weight * complex(sent[0, t], sent[1, t])
        s_re, s_im = np.float32(part.real) * near, np.float32(part.imag) * near
        re, im = out[0, t * count : (t + 1) * count], out[1, t * count : (t + 1) * count]
        for r in range(count):
            c = along + r3[r]
            q_t2 = _TWO + _TWO * (x * r0[r] + y * r1[r] + z * r2[r]) - c * c
            # Not `max` and `min`: calls, which keep the loop scalar.
            e = factor * (q_t2 if q_t2 > none else none)
            lit = (r3[r] > none) & (e < most)
            # e^−e = (e^−e/16)^16, the inner one by its series.
            a = (e if e < most else most) * _SIXTEENTH
            s = _ONE + a * (_ONE + a * (_HALF + a * (_E3 + a * (_E4 + a * _E5))))
            s = s * s
            s = s * s
            s = s * s
            s = s * s
            value = c * r4[r] * s if lit else none
            re[r] = value * (s_re * h_re[r] - s_im * h_im[r])
            im[r] = value * (s_re * h_im[r] + s_im * h_re[r])


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def centre_values(
    rx: np.ndarray, sent: np.ndarray, heard: np.ndarray, weight: complex, out: np.ndarray
) -> None:
    """The same with the amplitude of the centres, which is part of the weight."""
    near, h_re, h_im = rx[4], heard[0], heard[1]
    count = len(near)
    for t in range(sent.shape[1]):
        part = weight * complex(sent[0, t], sent[1, t])
        s_re, s_im = np.float32(part.real), np.float32(part.imag)
        re, im = out[0, t * count : (t + 1) * count], out[1, t * count : (t + 1) * count]
        for r in range(count):
            re[r] = near[r] * (s_re * h_re[r] - s_im * h_im[r])
            im[r] = near[r] * (s_re * h_im[r] + s_im * h_re[r])


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def spread_values(values: np.ndarray, kernel: np.ndarray, first: int, out: np.ndarray) -> None:
    """Adds the values of all links to the cells around a delay.

    Args:
        values: Real and imaginary, float32, shape (2, link).
        kernel: The window over the cells, shape (`WIDTH`,).
        first: First cell, which may lie beyond the grid.
        out: The grid of a node, float32, shape (2, cell, link).
    """
    cells = out.shape[1]
    a, b, c, d = first % cells, (first + 1) % cells, (first + 2) % cells, (first + 3) % cells
    k_a, k_b, k_c, k_d = kernel[0], kernel[1], kernel[2], kernel[3]
    for part in range(2):
        row = values[part]
        at_a, at_b, at_c, at_d = out[part, a], out[part, b], out[part, c], out[part, d]
        for link in range(len(row)):
            value = row[link]
            at_a[link] += k_a * value
            at_b[link] += k_b * value
            at_c[link] += k_c * value
            at_d[link] += k_d * value
