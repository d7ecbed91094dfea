# SPDX-License-Identifier: Apache-2.0
"""The matched filter of narrow sub-bands, summed subcarrier by subcarrier.

A sub-band of a few subcarriers is cheaper to sum than to transform into a delay profile and read
(`back_projection`): from one subcarrier to the next the phasor of every path turns by the same
angle, so that a term takes eight multiplications and additions, of many points at once.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Complex, Float, Int

from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Points that share one pass over all links: their sums of a device pair stay in the L1 cache.
CHUNK = 64


@numba.njit(forceinline=True, fastmath=True, cache=True)
def _turns(
    points: np.ndarray, elements: np.ndarray, per_m: float, step_per_m: float, out: np.ndarray
) -> None:
    """exp(+j k d) at the first subcarrier and what the next one adds: (element, 4, point).

    Phases are reduced in double: at 60 GHz they reach thousands of radians.
    """
    for e in range(len(elements)):
        for n in range(len(points)):
            x, y = points[n, 0] - elements[e, 0], points[n, 1] - elements[e, 1]
            z = points[n, 2] - elements[e, 2]
            d = np.sqrt(x * x + y * y + z * z)
            first, step = per_m * d, step_per_m * d
            angle = np.float32(2.0 * np.pi * (first - np.floor(first)))
            out[e, 0, n], out[e, 1, n] = np.cos(angle), np.sin(angle)
            angle = np.float32(2.0 * np.pi * (step - np.floor(step)))
            out[e, 2, n], out[e, 3, n] = np.cos(angle), np.sin(angle)


@numba.njit(forceinline=True, fastmath=True, cache=True)
def _joined(t: np.ndarray, r: np.ndarray, out: np.ndarray) -> None:
    """The phasors of both legs together, rows as in `_turns`."""
    for n in range(out.shape[1]):
        out[0, n] = t[0, n] * r[0, n] - t[1, n] * r[1, n]
        out[1, n] = t[0, n] * r[1, n] + t[1, n] * r[0, n]
        out[2, n] = t[2, n] * r[2, n] - t[3, n] * r[3, n]
        out[3, n] = t[2, n] * r[3, n] + t[3, n] * r[2, n]


@numba.njit(forceinline=True, fastmath=True, cache=True)
def _add_one(a: float, b: float, z: np.ndarray, total: np.ndarray) -> None:
    """Adds a + j b at one subcarrier, and turns z on to the next."""
    x, y, u, v = z[0], z[1], z[2], z[3]
    real, imaginary = total[0], total[1]
    for n in range(len(x)):
        p, q = x[n], y[n]
        real[n] += a * p - b * q
        imaginary[n] += a * q + b * p
        x[n], y[n] = p * u[n] - q * v[n], p * v[n] + q * u[n]


@numba.njit(forceinline=True, fastmath=True, cache=True)
def _add_two(a: float, b: float, c: float, d: float, z: np.ndarray, total: np.ndarray) -> None:
    """Adds a + j b at one subcarrier and c + j d at the next, with half as many writes."""
    x, y, u, v = z[0], z[1], z[2], z[3]
    real, imaginary = total[0], total[1]
    for n in range(len(x)):
        p, q = x[n], y[n]
        s, t = p * u[n] - q * v[n], p * v[n] + q * u[n]
        real[n] += a * p - b * q + (c * s - d * t)
        imaginary[n] += a * q + b * p + (c * t + d * s)
        x[n], y[n] = s * u[n] - t * v[n], s * v[n] + t * u[n]


@numba.njit(parallel=True, cache=True)
def _sum_bands(
    real: np.ndarray,
    imaginary: np.ndarray,
    edges: np.ndarray,
    per_m: tuple[float, float],
    ends: tuple[np.ndarray, np.ndarray],
    links: np.ndarray,
    points: np.ndarray,
    out: np.ndarray,
) -> None:
    """Fills `out[pair, band, re/im, point]`; `links` rows are tx, rx and pair of a channel."""
    tx_xyz, rx_xyz = ends
    for chunk in numba.prange((len(points) + CHUNK - 1) // CHUNK):
        first = chunk * CHUNK
        count = min(CHUNK, len(points) - first)
        here = points[first : first + count]
        t = np.zeros((len(tx_xyz), 4, count), np.float32)
        r = np.zeros((len(rx_xyz), 4, count), np.float32)
        _turns(here, tx_xyz, per_m[0], per_m[1], t)
        _turns(here, rx_xyz, per_m[0], per_m[1], r)
        total = np.zeros((out.shape[0], out.shape[1], 2, count), np.float32)
        z = np.zeros((4, count), np.float32)
        for link in range(len(links)):
            _joined(t[links[link, 0]], r[links[link, 1]], z)
            h, g = real[link], imaginary[link]
            for band in range(len(edges) - 1):
                sums = total[links[link, 2], band]
                f, end = edges[band], edges[band + 1]
                while f + 1 < end:
                    _add_two(h[f], g[f], h[f + 1], g[f + 1], z, sums)
                    f += 2
                if f < end:
                    _add_one(h[f], g[f], z, sums)
        out[:, :, :, first : first + count] = total


def sum_bands(
    csi: Complex[np.ndarray, "link subcarrier"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    edges: Int[np.ndarray, "edge"],
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    points: Float[np.ndarray, "N 3"],
) -> Complex[np.ndarray, "pair band N"]:
    """Channels times exp(+j k (d_t + d_r)), averaged over each sub-band and the links of a pair.

    Args:
        csi: Channels of the links with `pair >= 0`, in row-major order.
        freq_hz: Their subcarriers [Hz], equally spaced.
        edges: First subcarrier of each sub-band, and the number of subcarriers.
        tx_xyz: Transmitting elements [m].
        rx_xyz: Receiving elements [m].
        pair: Which sum a link belongs to; negative links are left out.
        points: Where to evaluate [m].
    """
    tx_index, rx_index = np.nonzero(pair >= 0)
    link_pair = pair[tx_index, rx_index].astype(np.int64)
    counts = np.bincount(link_pair)
    out = np.zeros((len(counts), len(edges) - 1, 2, len(points)), dtype=np.float32)
    spacing_hz = float(freq_hz[1] - freq_hz[0]) if len(freq_hz) > 1 else 0.0
    _sum_bands(
        np.ascontiguousarray(csi.real, dtype=np.float32),
        np.ascontiguousarray(csi.imag, dtype=np.float32),
        edges.astype(np.int64),
        (float(freq_hz[0]) / SPEED_OF_LIGHT, spacing_hz / SPEED_OF_LIGHT),
        (np.ascontiguousarray(tx_xyz, dtype=np.float64), np.ascontiguousarray(rx_xyz, np.float64)),
        np.stack([tx_index, rx_index, link_pair], axis=1),
        np.ascontiguousarray(points, dtype=np.float64),
        out,
    )
    terms = np.maximum(counts, 1)[:, None, None] * np.diff(edges)[:, None]
    return (out[:, :, 0] + 1j * out[:, :, 1]) / terms.astype(np.float32)
