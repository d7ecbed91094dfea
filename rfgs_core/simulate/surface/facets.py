# SPDX-License-Identifier: Apache-2.0
"""Scattering of small facets: the closed form that people are made of.

A facet of area A and unit normal n, met from k_i and seen along k_s (directions of
propagation), scatters with

    √σ = √(4π) A/λ |Γ| (n·k_s − n·k_i)/2 exp(−k² q_t² A/24),     q = k_s − k_i,

q_t being the part of q in the facet's plane. It is the physical-optics integral of a square
facet, its sinc replaced by the Gaussian of equal curvature, lit side only. With Kirchhoff's
phase the channel of one facet is

    H = j Γ A (n·k_s − n·k_i)/2 exp(−k² q_t² A/24) e^{−jk(d_t+d_r)} / (4π d_t d_r),

the wavelength of √σ cancelling against that of the radar equation.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.paths.plain_sum import summed

_BLOCK = 64
#: Facets damped by more than e^-30 are below −260 dB and are left out.
_MAX_DAMPING = 30.0


def facet_sum(
    points: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    tx_xyz: np.ndarray,
    rx_xyz: np.ndarray,
    weights: np.ndarray,
    freq_hz: np.ndarray,
) -> np.ndarray:
    """Channel of a set of facets between antennas at exact spherical distances.

    Γ is left out: it does not depend on the geometry, so the caller multiplies.

    Args:
        points: Positions of the facets [m], shape (point, 3).
        normals: Unit normals, shape (point, 3).
        areas: Areas [m²], shape (point,).
        tx_xyz: Transmitting elements [m], shape (tx, 3).
        rx_xyz: Receiving elements [m], shape (rx, 3).
        weights: Factor per facet, 0 where it is not visible from both ends, shape (point,).
        freq_hz: Equally spaced frequencies [Hz], shape (subcarrier,).

    Returns:
        H / Γ, complex128, shape (tx, rx, subcarrier).
    """
    used = np.flatnonzero(weights)
    wavenumber = 2.0 * np.pi * np.asarray(freq_hz, dtype=np.float64) / SPEED_OF_LIGHT
    step = float(wavenumber[1] - wavenumber[0]) if len(wavenumber) > 1 else 0.0
    return _facet_sum(
        np.ascontiguousarray(points[used], dtype=np.float64),
        np.ascontiguousarray(normals[used], dtype=np.float64),
        np.ascontiguousarray(areas[used], dtype=np.float64),
        np.ascontiguousarray(weights[used], dtype=np.float64),
        np.ascontiguousarray(tx_xyz, dtype=np.float64),
        np.ascontiguousarray(rx_xyz, dtype=np.float64),
        float(wavenumber[0]),
        step,
        len(wavenumber),
    )


@numba.njit(cache=True, inline="always")
def _geometry(
    p: np.ndarray, n: np.ndarray, t: np.ndarray, r: np.ndarray
) -> tuple[float, float, float]:
    """Path length [m], amplitude factor (n·k_s − n·k_i)/2 / (4π d_t d_r) and q_t² of a facet."""
    ix, iy, iz = p[0] - t[0], p[1] - t[1], p[2] - t[2]
    sx, sy, sz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    d_t = math.sqrt(ix * ix + iy * iy + iz * iz)
    d_r = math.sqrt(sx * sx + sy * sy + sz * sz)
    c_i = -(ix * n[0] + iy * n[1] + iz * n[2]) / d_t
    c_s = (sx * n[0] + sy * n[1] + sz * n[2]) / d_r
    if c_i <= 0.0 or c_s <= 0.0:
        return d_t + d_r, 0.0, 0.0
    qx, qy, qz = sx / d_r - ix / d_t, sy / d_r - iy / d_t, sz / d_r - iz / d_t
    q_n = c_s + c_i
    q_t2 = max(qx * qx + qy * qy + qz * qz - q_n * q_n, 0.0)
    return d_t + d_r, 0.5 * q_n / (4.0 * math.pi * d_t * d_r), q_t2


@numba.njit(cache=True)
def _next_subcarrier(
    value: tuple[np.ndarray, np.ndarray],
    turn: tuple[np.ndarray, np.ndarray],
    fade: np.ndarray,
    filled: int,
) -> None:
    """Moves a block's phasors, given as real and imaginary parts, on to the next subcarrier."""
    for j in range(filled):
        re, im, turn_re, turn_im = value[0][j], value[1][j], turn[0][j], turn[1][j]
        value[0][j], value[1][j] = re * turn_re - im * turn_im, re * turn_im + im * turn_re
        turn[0][j], turn[1][j] = turn_re * fade[j], turn_im * fade[j]


@numba.njit(cache=True, parallel=True)
def _facet_sum(
    points: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    weights: np.ndarray,
    tx_xyz: np.ndarray,
    rx_xyz: np.ndarray,
    k_0: float,
    k_step: float,
    subcarriers: int,
) -> np.ndarray:
    """Sums phasors over facets, subcarrier by subcarrier, through recurrences.

    From subcarrier to subcarrier the phase advances by a constant and the damping exp(−k²Q) by a
    factor that itself shrinks by exp(−2 k_step² Q): two multiplications instead of exp, sin and
    cos.
    """
    n_tx, n_rx, n_points = len(tx_xyz), len(rx_xyz), len(points)
    out = np.zeros((n_tx, n_rx, subcarriers), dtype=np.complex128)
    for link in numba.prange(n_tx * n_rx):
        tx, rx = link // n_rx, link % n_rx
        value_re, value_im = np.zeros(_BLOCK), np.zeros(_BLOCK)
        turn_re, turn_im, fade = np.zeros(_BLOCK), np.zeros(_BLOCK), np.zeros(_BLOCK)
        first = 0
        while first < n_points:
            filled = 0
            while first < n_points and filled < _BLOCK:
                i = first
                first += 1
                d, amplitude, q_t2 = _geometry(points[i], normals[i], tx_xyz[tx], rx_xyz[rx])
                damping = q_t2 * areas[i] / 24.0
                if amplitude == 0.0 or k_0 * k_0 * damping > _MAX_DAMPING:
                    continue
                amplitude *= weights[i] * areas[i] * math.exp(-k_0 * k_0 * damping)
                value_re[filled] = amplitude * math.cos(k_0 * d)
                value_im[filled] = -amplitude * math.sin(k_0 * d)
                drop = math.exp(-(2.0 * k_0 + k_step) * k_step * damping)
                turn_re[filled] = drop * math.cos(k_step * d)
                turn_im[filled] = -drop * math.sin(k_step * d)
                fade[filled] = math.exp(-2.0 * k_step * k_step * damping)
                filled += 1
            for subcarrier in range(subcarriers):
                value, turn = (value_re, value_im), (turn_re, turn_im)
                sum_re, sum_im = summed(value_re[:filled]), summed(value_im[:filled])
                _next_subcarrier(value, turn, fade, filled)
                # The facet's constant phase: Kirchhoff's j.
                out[tx, rx, subcarrier] += complex(-sum_im, sum_re)
    return out
