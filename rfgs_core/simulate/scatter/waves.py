# SPDX-License-Identifier: Apache-2.0
"""A wave at every node of the band: sent, past a slab, and in the components that a facet hears."""

from __future__ import annotations

import math

import numba
import numpy as np

from rfgs_core.simulate.scatter.antenna import Antenna, sent_towards


@numba.njit(cache=True, nogil=True, inline="always")
def send(antenna: Antenna, way: np.ndarray, wave: np.ndarray) -> None:
    """Fills in what an antenna sends in a direction, the same at each node."""
    x, y, z = sent_towards(antenna, way)
    for m in range(len(wave)):
        wave[m, 0], wave[m, 1], wave[m, 2] = x, y, z


@numba.njit(cache=True, nogil=True)
def past(
    wave: np.ndarray, into: np.ndarray, normal: np.ndarray, mirrors: bool, factors: np.ndarray
) -> None:
    """Sends a wave past a slab, in place; the twin of `rfgs_core.simulate.paths.fields.past_slab`.

    Args:
        wave: Field at each node, complex64, shape (node, 3).
        into: Its direction, of any length, shape (3,).
        normal: Unit normal of the slab, either side.
        mirrors: Whether the wave is mirrored, else it passes.
        factors: TE and TM factors over cosines, shape (cosine, 2, node).
    """
    d = math.sqrt(into[0] * into[0] + into[1] * into[1] + into[2] * into[2])
    k = into[0] / d, into[1] / d, into[2] / d
    n = normal[0], normal[1], normal[2]
    along = k[0] * n[0] + k[1] * n[1] + k[2] * n[2]
    across = _cross(k, n)
    size = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
    if size < 1e-9:
        # At normal incidence any direction in the wall is across.
        across = _cross(n, (1.0, 0.0, 0.0) if abs(n[0]) < 0.6 else (0.0, 1.0, 0.0))
        size = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
    across = across[0] / size, across[1] / size, across[2] / size
    bend = 2.0 * along if mirrors else 0.0
    before = _cross(across, k)
    after = _cross(across, (k[0] - bend * n[0], k[1] - bend * n[1], k[2] - bend * n[2]))
    place = min(abs(along), 1.0) * (len(factors) - 1)
    low = min(int(place), len(factors) - 2)
    share = np.float32(place - low)
    for m in range(len(wave)):
        te = factors[low, 0, m] + share * (factors[low + 1, 0, m] - factors[low, 0, m])
        tm = factors[low, 1, m] + share * (factors[low + 1, 1, m] - factors[low, 1, m])
        te *= wave[m, 0] * across[0] + wave[m, 1] * across[1] + wave[m, 2] * across[2]
        tm *= wave[m, 0] * before[0] + wave[m, 1] * before[1] + wave[m, 2] * before[2]
        for axis in range(3):
            wave[m, axis] = te * across[axis] + tm * after[axis]


@numba.njit(cache=True, nogil=True, inline="always")
def _cross(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Cross product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@numba.njit(cache=True, nogil=True, inline="always")
def components(wave: np.ndarray, way: np.ndarray, out: np.ndarray) -> None:
    """Fills in θ and φ of a wave at each node, complex64, shape (2, node)."""
    flat = math.hypot(way[0], way[1])
    d = math.hypot(flat, way[2])
    cos_phi, sin_phi = (way[0] / flat, way[1] / flat) if flat > 1e-7 * d else (1.0, 0.0)
    cos_theta, sin_theta = way[2] / d, flat / d
    for m in range(len(wave)):
        along = wave[m, 0] * cos_phi + wave[m, 1] * sin_phi
        out[0, m] = along * cos_theta - wave[m, 2] * sin_theta
        out[1, m] = wave[m, 1] * cos_phi - wave[m, 0] * sin_phi
