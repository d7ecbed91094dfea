# SPDX-License-Identifier: Apache-2.0
"""Responses of one device pair to the facets of a posed body, and the evidence of what it heard.

Facets of random phases make the entries y of a pair a normal vector,

    y ~ CN(0, s (Σ_i w_i² a_i a_iᴴ + n I)),

a_i being the steered and summed response to facet i, of weight

    w = √A · ½(n·û_t + n·û_r) / (d_t d_r) · exp(−sin²∠(n, û_t + û_r) / (4σ²))

where both ends see it. Where the way on is nearly the way in, the lit side shadows, as a screen
of amplitude √A n·û_t / (d_t d_r) that the receiver need not see. The level s has a closed form, the
share of noise n is the best of a few (the evidence of a linear model; MacKay, Neural Computation
4(3), 1992).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Bool, Complex, Complex64, Float64, Int64

from rfgs_core.lapack import product_with_itself, tridiagonal
from rfgs_core.limbs.evidence.entries import Pair
from rfgs_core.vector_math import FAST_MATH, sine_cosine_of_turns
from rfgs_core.worlds.echoes import shadowing

#: Shares of noise that are tried, against the mean power of the echoes.
NOISE_SHARES = 10.0 ** np.arange(-2.5, 1.01, 0.5)
#: Facets weaker than this, against the strongest, are left out.
_WEAKEST = 0.05


class Facets(NamedTuple):
    """A posed surface."""

    points: Float64[np.ndarray, "facet 3"]
    """Places [m]."""
    normals: Float64[np.ndarray, "facet 3"]
    root_area: Float64[np.ndarray, "facet"]
    """Square roots of their areas [m]."""

    def moved(self, shift: np.ndarray) -> Facets:
        """The same somewhere else [m]."""
        return self._replace(points=self.points + shift)

    def thinned(self, every: int) -> Facets:
        """Some of them for all: of as much power on average."""
        few = (np.ascontiguousarray(values[::every]) for values in self)
        points, normals, root = few
        return Facets(points, normals, root * math.sqrt(every))


class Images(NamedTuple):
    """Images to a body and on: each with one leg by a mirror across one of the world's axes."""

    end: Int64[np.ndarray, "image"]
    """0 where the transmitter is mirrored, 1 where the receiver is, −1 where neither is."""
    axis: Int64[np.ndarray, "image"]
    """The world's axis across which the mirror lies."""
    at_m: Float64[np.ndarray, "image"]
    """Where on that axis [m]."""

    @staticmethod
    def of(images: list[tuple[int, int, float]]) -> Images:
        """Of end, axis and place of each."""
        end, axis, at_m = np.array(images, dtype=np.float64).reshape(-1, 3).T
        return Images(end.astype(np.int64), axis.astype(np.int64), at_m.copy())


#: Both ends as they are.
STRAIGHT = Images.of([(-1, 0, 0.0)])


def covariance(
    pair: Pair, facets: Facets, by_tx: Bool[np.ndarray, "facet"], by_rx: Bool[np.ndarray, "facet"],
    lobe_rad: float, images: Images = STRAIGHT,
) -> Complex64[np.ndarray, "entry entry"]:  # fmt: skip
    """Covariance of a pair's entries, without noise; only the upper triangle is filled.

    Args:
        pair: The pair.
        facets: The posed surface.
        by_tx: Facets that the transmitter sees; those that face away are left out anyhow.
        by_rx: Facets that the receiver sees.
        lobe_rad: Width σ of the lobe around a facet's normal [rad].
        images: Ends that are mirrored; the covariances by way of each are added up.
    """
    tx, rx, bands = pair.tx, pair.rx, pair.bands
    rows = _responses(
        *facets, by_tx, by_rx, *images, tx.xyz, rx.xyz, tx.steered_m, rx.steered_m, tx.block,
        rx.block,
        tx.share, rx.share, bands.first_k, bands.step_k, bands.middle_k, bands.block, bands.share,
        lobe_rad,
    )  # fmt: skip
    return product_with_itself(rows)


def log_evidence(
    change: Complex[np.ndarray, "entry"],
    covariance: Complex[np.ndarray, "entry entry"],
    least_noise: float = 0.0,
    shares: Float64[np.ndarray, "share"] = NOISE_SHARES,
) -> float:
    """Log evidence of entries at the best level and share of noise [nat].

    Zero where nothing was heard or nothing is seen, which speaks for no pose.

    Args:
        change: Entries.
        covariance: Their covariance without level and noise, at least its upper triangle; what is
            in single precision is reduced in single precision.
        least_noise: Smaller shares of noise are not tried.
        shares: Shares of noise that are tried, against the mean power of the echoes.
    """
    if not change.any():
        return 0.0
    tried = shares[shares >= 0.999 * least_noise]
    return _best_log(change.astype(covariance.dtype), covariance, tried)


@numba.njit(cache=True, nogil=True)
def _best_log(change: np.ndarray, covariance: np.ndarray, shares: np.ndarray) -> float:
    """Log evidence at the best of some shares of noise n; zero where nothing is seen.

    With two diagonals L D Lᴴ of T + n I costs little for each share, and eigenvectors none at all.
    The best level s has a closed form: the mean of what is heard, whitened by the covariance.
    """
    best, size, mean = -np.inf, len(change), 0.0
    for i in range(size):
        mean += covariance[i, i].real / size
    if mean <= 0.0:
        return 0.0
    diagonal, beside, turned = tridiagonal(covariance, change)
    for share in shares:
        pivot, rest, times = 1.0, 0.0j, 0.0
        power, spread = 0.0, 0.0
        for i in range(size):
            rest = turned[i] - times * rest
            under = times * beside[i - 1] / mean if i else 0.0
            # No pivot is below the least eigenvalue, that of noise: what is, has been rounded.
            pivot = max(diagonal[i] / mean + share - under, share)
            power += (rest.real * rest.real + rest.imag * rest.imag) / pivot
            spread += math.log(pivot)
            times = beside[i] / mean / pivot
        best = max(best, -size * (math.log(power / size) + 1.0) - spread)
    return best


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


@numba.njit(cache=True, nogil=True, fastmath=FAST_MATH)
def _responses(
    points: np.ndarray, normals: np.ndarray, root_area: np.ndarray, by_tx: np.ndarray,
    by_rx: np.ndarray, end: np.ndarray, axis: np.ndarray, at: np.ndarray, tx: np.ndarray,
    rx: np.ndarray, tx_steered: np.ndarray, rx_steered: np.ndarray,
    tx_block: np.ndarray, rx_block: np.ndarray, tx_share: np.ndarray, rx_share: np.ndarray,
    first_k: float, step_k: float, middle_k: float, band: np.ndarray, band_share: np.ndarray,
    lobe: float,
) -> np.ndarray:  # fmt: skip
    """Conjugate weighted responses of what counts, complex64, shape (entry, image and facet)."""
    mid, mirrored = np.zeros((2, 3)), np.zeros((2, 3))
    for i in range(3):
        mid[0, i], mid[1, i] = tx[:, i].mean(), rx[:, i].mean()
    tx_m, rx_m = tx_steered.mean(), rx_steered.mean()
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
                # Across the band only the length of the path counts, not that within the arrays.
                late[used] = path[i] - tx_m - rx_m
                strength[used] = weight[i]
                used += 1
    per_m = 1.0 / (2.0 * math.pi)
    by_end, late, strength = sees[:, :, :used].copy(), late[:used], strength[:used]
    sent = _array_responses(by_end[0], tx, tx_steered, tx_block, tx_share, middle_k * per_m)
    heard = _array_responses(by_end[1], rx, rx_steered, rx_block, rx_share, middle_k * per_m)
    banded = _band_responses(late, (first_k - middle_k) * per_m, step_k * per_m, band, band_share)
    return _products(sent, heard, banded, strength.astype(np.float32))


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
