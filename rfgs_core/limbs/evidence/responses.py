# SPDX-License-Identifier: Apache-2.0
"""What the blocks of a device pair hear of facets: kernels without types of their own."""

from __future__ import annotations

import math

import numba
import numpy as np

from rfgs_core.vector_math import FAST_MATH, sine_cosine_of_turns
from rfgs_core.worlds.echoes import shadowing

#: Facets weaker than this, against the strongest, are left out.
_WEAKEST = 0.05


@numba.njit(cache=True, nogil=True, inline="always")
def _weight(
    x: np.ndarray, n: np.ndarray, tx: np.ndarray, rx: np.ndarray, heard: bool, lobe: float
) -> tuple[float, float]:
    """Weight of a facet that the transmitter sees, and the length of its path [m]."""
    t0, t1, t2 = tx[0] - x[0], tx[1] - x[1], tx[2] - x[2]
    r0, r1, r2 = rx[0] - x[0], rx[1] - x[1], rx[2] - x[2]
    d_t = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    d_r = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    c_t = (t0 * n[0] + t1 * n[1] + t2 * n[2]) / d_t
    c_r = (r0 * n[0] + r1 * n[1] + r2 * n[2]) / d_r
    if c_t <= 0.0:
        return 0.0, d_t + d_r
    forward = -(t0 * r0 + t1 * r1 + t2 * r2) / (d_t * d_r)
    sent = 0.0
    if heard and c_r > 0.0:
        # |û_t + û_r|², and the square of its part along the normal.
        whole = 2.0 - 2.0 * forward
        sine2 = max(1.0 - (c_t + c_r) ** 2 / max(whole, 1e-9), 0.0)
        sent = 0.5 * (c_t + c_r) * math.exp(-sine2 / (4.0 * lobe * lobe))
    sent += shadowing(forward) * c_t
    return sent / (d_t * d_r), d_t + d_r


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_MATH)
def _array_responses(
    x: np.ndarray, xyz: np.ndarray, steered: np.ndarray, block: np.ndarray, share: np.ndarray,
    per_m: float,
) -> np.ndarray:  # fmt: skip
    """Response of each block of an array to points [m], rows real and imaginary, (block, 2, N)."""
    out, late = np.zeros((len(share), 2, x.shape[1]), np.float32), np.zeros(x.shape[1])
    x0, x1, x2 = x[0], x[1], x[2]
    for e in range(len(xyz)):
        real, imaginary, times = out[block[e], 0], out[block[e], 1], np.float32(share[block[e]])
        a, b, c, away = xyz[e, 0], xyz[e, 1], xyz[e, 2], steered[e]
        # One loop over this many arrays, which might overlap, would not become vector code.
        for i in range(x.shape[1]):
            p, q, r = a - x0[i], b - x1[i], c - x2[i]
            late[i] = math.sqrt(p * p + q * q + r * r) - away
        for i in range(x.shape[1]):
            turns = per_m * late[i]
            sine, cosine = sine_cosine_of_turns(np.float32(turns - np.floor(turns + 0.5)))
            real[i] += times * cosine
            imaginary[i] -= times * sine
    return out


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_MATH)
def _band_responses(
    late: np.ndarray, first_per_m: float, step_per_m: float, band: np.ndarray, share: np.ndarray
) -> np.ndarray:
    """Response of each band to paths longer by `late` [m], as `_array_responses`."""
    out, wave = np.zeros((len(share), 2, len(late)), np.float32), np.zeros((4, len(late)))
    x, y, u, v = wave[0], wave[1], wave[2], wave[3]
    for i in range(len(late)):
        first, step = first_per_m * late[i], step_per_m * late[i]
        sine, cosine = sine_cosine_of_turns(np.float32(first - np.floor(first + 0.5)))
        x[i], y[i] = cosine, -sine
        sine, cosine = sine_cosine_of_turns(np.float32(step - np.floor(step + 0.5)))
        u[i], v[i] = cosine, -sine
    for f in range(len(band)):
        if band[f] >= 0:
            real, imaginary, times = out[band[f], 0], out[band[f], 1], share[band[f]]
            for i in range(len(late)):
                real[i] += times * x[i]
                imaginary[i] += times * y[i]
        for i in range(len(late)):
            x[i], y[i] = x[i] * u[i] - y[i] * v[i], x[i] * v[i] + y[i] * u[i]
    return out


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_MATH)
def _lit(
    points: np.ndarray, normals: np.ndarray, root_area: np.ndarray, by_tx: np.ndarray,
    by_rx: np.ndarray, end: np.ndarray, axis: np.ndarray, at: np.ndarray, tx: np.ndarray,
    rx: np.ndarray, steered_m: float, lobe: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """What counts: places as each end sees them (end, 3, N), path beyond a length [m], weights."""
    mid, mirrored = np.zeros((2, 3)), np.zeros((2, 3))
    for i in range(3):
        mid[0, i], mid[1, i] = tx[:, i].mean(), rx[:, i].mean()
    most, used = len(end) * len(points), 0
    # Where facets are for each end: mirrored in its stead, which leaves distances the same.
    sees = np.zeros((2, 3, most))
    late, strength = np.zeros(most), np.zeros(most)
    weight, path = np.zeros(len(points)), np.zeros(len(points))
    for k in range(len(end)):
        mirrored[:] = mid
        if end[k] >= 0:
            mirrored[end[k], axis[k]] = 2.0 * at[k] - mid[end[k], axis[k]]
        weight[:] = 0.0
        for i in range(len(points)):
            if by_tx[i]:
                weight[i], path[i] = _weight(
                    points[i], normals[i], mirrored[0], mirrored[1], by_rx[i], lobe
                )
                weight[i] *= root_area[i]
        weakest = _WEAKEST * weight.max()
        for i in range(len(points)):
            if weight[i] > weakest:
                sees[0, :, used] = points[i]
                sees[1, :, used] = points[i]
                if end[k] >= 0:
                    sees[end[k], axis[k], used] = 2.0 * at[k] - points[i, axis[k]]
                late[used] = path[i] - steered_m
                strength[used] = weight[i]
                used += 1
    return sees[:, :, :used].copy(), late[:used], strength[:used]


@numba.njit(cache=True, nogil=True, fastmath=FAST_MATH)
def responses(
    points: np.ndarray, normals: np.ndarray, root_area: np.ndarray, by_tx: np.ndarray,
    by_rx: np.ndarray, end: np.ndarray, axis: np.ndarray, at: np.ndarray, tx: np.ndarray,
    rx: np.ndarray, tx_steered: np.ndarray, rx_steered: np.ndarray,
    tx_block: np.ndarray, rx_block: np.ndarray, tx_share: np.ndarray, rx_share: np.ndarray,
    first_k: float, step_k: float, middle_k: float, band: np.ndarray, band_share: np.ndarray,
    lobe: float,
) -> np.ndarray:  # fmt: skip
    """Conjugate weighted responses of what counts, complex64, shape (entry, image and facet).

    Across the band only the length of the path counts, not that within the arrays.
    """
    by_end, late, strength = _lit(
        points, normals, root_area, by_tx, by_rx, end, axis, at, tx, rx,
        tx_steered.mean() + rx_steered.mean(), lobe,
    )  # fmt: skip
    per_m = 1.0 / (2.0 * math.pi)
    sent = _array_responses(by_end[0], tx, tx_steered, tx_block, tx_share, middle_k * per_m)
    heard = _array_responses(by_end[1], rx, rx_steered, rx_block, rx_share, middle_k * per_m)
    banded = _band_responses(late, (first_k - middle_k) * per_m, step_k * per_m, band, band_share)
    return _products(sent, heard, banded, strength.astype(np.float32))


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_MATH)
def _mean_late(x: np.ndarray, xyz: np.ndarray, steered: np.ndarray) -> np.ndarray:
    """How much farther points are than the place steered to, mean over an array's elements [m]."""
    late = np.zeros(x.shape[1])
    for e in range(len(xyz)):
        for i in range(x.shape[1]):
            p, q, r = xyz[e, 0] - x[0, i], xyz[e, 1] - x[1, i], xyz[e, 2] - x[2, i]
            late[i] += (math.sqrt(p * p + q * q + r * r) - steered[e]) / len(xyz)
    return late


@numba.njit(cache=True, nogil=True, fastmath=FAST_MATH)
def wide_responses(
    points: np.ndarray, normals: np.ndarray, root_area: np.ndarray, by_tx: np.ndarray,
    by_rx: np.ndarray, end: np.ndarray, axis: np.ndarray, at: np.ndarray, tx: np.ndarray,
    rx: np.ndarray, tx_steered: np.ndarray, rx_steered: np.ndarray,
    tx_block: np.ndarray, rx_block: np.ndarray, tx_share: np.ndarray, rx_share: np.ndarray,
    first_k: float, step_k: float, band: np.ndarray, band_share: np.ndarray, lobe: float,
) -> np.ndarray:  # fmt: skip
    """The same where beams turn across the band: each of its parts has its own wavenumber."""
    per_m = 1.0 / (2.0 * math.pi)
    by_end, _, strength = _lit(
        points, normals, root_area, by_tx, by_rx, end, axis, at, tx, rx, 0.0, lobe
    )
    late = _mean_late(by_end[0], tx, tx_steered) + _mean_late(by_end[1], rx, rx_steered)
    weight, bands = strength.astype(np.float32), len(band_share)
    out = np.zeros((len(tx_share) * len(rx_share) * bands, len(weight)), np.complex64)
    for f in range(bands):
        own = np.flatnonzero(band == f)
        first, last = own[0], own[-1] + 1
        own_k = first_k + step_k * own.mean()
        sent = _array_responses(by_end[0], tx, tx_steered, tx_block, tx_share, own_k * per_m)
        heard = _array_responses(by_end[1], rx, rx_steered, rx_block, rx_share, own_k * per_m)
        single = np.where(band[first:last] == f, 0, -1)
        ahead = (first_k + step_k * first - own_k) * per_m
        banded = _band_responses(late, ahead, step_k * per_m, single, band_share[f : f + 1])
        out[f::bands] = _products(sent, heard, banded, weight)
    return out


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_MATH)
def _products(
    sent: np.ndarray, heard: np.ndarray, banded: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """Conjugates of all products of three responses and a weight, complex64, (entry, facet)."""
    count = len(weight)
    out = np.zeros((len(sent) * len(heard) * len(banded), 2 * count), np.float32)
    both, e = np.zeros((2, count), np.float32), 0
    for a in range(len(sent)):
        for b in range(len(heard)):
            for i in range(count):
                p, q, r, s = sent[a, 0, i], sent[a, 1, i], heard[b, 0, i], heard[b, 1, i]
                both[0, i], both[1, i] = weight[i] * (p * r - q * s), weight[i] * (p * s + q * r)
            for f in range(len(banded)):
                row = out[e]
                for i in range(count):
                    p, q, r, s = both[0, i], both[1, i], banded[f, 0, i], banded[f, 1, i]
                    row[2 * i], row[2 * i + 1] = p * r - q * s, -(p * s + q * r)
                e += 1
    return out.view(np.complex64)
