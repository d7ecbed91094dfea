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

import functools
import math
from typing import Any, NamedTuple

import numba
import numpy as np
from jaxtyping import Bool, Complex64, Complex128, Float64

from rfgs_core.limbs.evidence.entries import End, Pair
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


def covariance(
    pair: Pair, facets: Facets, by_tx: Bool[np.ndarray, "facet"], by_rx: Bool[np.ndarray, "facet"],
    lobe_rad: float,
    tx: End | None = None, rx: End | None = None,
) -> Complex64[np.ndarray, "entry entry"]:  # fmt: skip
    """Covariance of a pair's entries, without noise; only the upper triangle is filled.

    Args:
        pair: The pair.
        facets: The posed surface.
        by_tx: Facets that the transmitter sees; those that face away are left out anyhow.
        by_rx: Facets that the receiver sees.
        lobe_rad: Width σ of the lobe around a facet's normal [rad].
        tx: Image of the transmitter in a wall; by default itself.
        rx: Image of the receiver.
    """
    tx, rx, bands = tx or pair.tx, rx or pair.rx, pair.bands
    rows = _responses(
        *facets, by_tx, by_rx, tx.xyz, rx.xyz, tx.steered_m, rx.steered_m, tx.block, rx.block,
        tx.share, rx.share, bands.first_k, bands.step_k, bands.middle_k, bands.block, bands.share,
        lobe_rad,
    )  # fmt: skip
    if not len(rows):
        return np.zeros((len(pair.change),) * 2, dtype=np.complex64)
    return _routines()[0](1.0, rows.T)


def log_evidence(
    change: Complex128[np.ndarray, "entry"], covariance: np.ndarray, least_noise: float = 0.0
) -> float:
    """Log evidence of entries at the best level and share of noise [nat].

    Zero where nothing was heard or nothing is seen, which speaks for no pose.

    Args:
        change: Entries.
        covariance: Their covariance without level and noise, at least its upper triangle.
        least_noise: Smaller shares of noise are not tried.
    """
    level = float(np.diagonal(covariance).real.mean())
    if not (level > 0.0 and change.any()):
        return 0.0
    matrix = (covariance / level).astype(np.complex128)
    known: dict[int, float] = {}

    def at(step: int) -> float:
        if step not in known:
            known[step] = _with_noise(change, matrix, float(NOISE_SHARES[step]))
        return known[step]

    # Evidence over the share of noise has one hill, which is climbed from the middle.
    first = int(np.searchsorted(NOISE_SHARES, 0.999 * least_noise))
    place, steps = len(NOISE_SHARES) // 2, range(first, len(NOISE_SHARES))
    while True:
        best = max((s for s in (place, place - 1, place + 1) if s in steps), key=at)
        if best == place:
            return known[place]
        place = best


@functools.cache
def _routines() -> tuple[Any, Any, Any]:
    """A Aᴴ in single precision; Cholesky's factor and solving with it in double."""
    from scipy.linalg import get_blas_funcs, get_lapack_funcs

    product: Any = get_blas_funcs("herk", dtype=np.complex64)
    cholesky, solve = get_lapack_funcs(("potrf", "trtrs"), dtype=np.complex128)
    return product, cholesky, solve


def _with_noise(change: np.ndarray, matrix: np.ndarray, noise: float) -> float:
    """Log evidence at one share of noise and the best level, by Cholesky's factor."""
    _, cholesky, solve = _routines()
    size = len(change)
    noisy = matrix.copy()
    noisy.ravel()[:: size + 1] += noise
    root, failed = cholesky(noisy, lower=0, clean=0)
    if failed:
        return -np.inf
    white = solve(root, change, lower=0, trans=2)[0]
    scale = float(np.vdot(white, white).real) / size
    spread = 2.0 * float(np.log(np.diagonal(root).real).sum())
    return -size * (math.log(scale) + 1.0) - spread


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


@numba.njit(cache=True, nogil=True, inline="always")
def _add_phases(
    x: np.ndarray, xyz: np.ndarray, steered: np.ndarray, block: np.ndarray, share: np.ndarray,
    k: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Response of each block of an array to a point."""
    out[:] = 0.0
    for e in range(len(xyz)):
        a, b, c = xyz[e, 0] - x[0], xyz[e, 1] - x[1], xyz[e, 2] - x[2]
        phase = k * (math.sqrt(a * a + b * b + c * c) - steered[e])
        out[block[e]] += share[block[e]] * complex(math.cos(phase), -math.sin(phase))


@numba.njit(cache=True, nogil=True, fastmath=True)
def _responses(
    points: np.ndarray, normals: np.ndarray, root_area: np.ndarray, by_tx: np.ndarray,
    by_rx: np.ndarray, tx: np.ndarray, rx: np.ndarray, tx_steered: np.ndarray,
    rx_steered: np.ndarray,
    tx_block: np.ndarray, rx_block: np.ndarray, tx_share: np.ndarray, rx_share: np.ndarray,
    first_k: float, step_k: float, middle_k: float, band: np.ndarray, band_share: np.ndarray,
    lobe: float,
) -> np.ndarray:  # fmt: skip
    """Weighted responses of the facets that count, complex64, shape (facet, entry)."""
    tx_mid, rx_mid = np.zeros(3), np.zeros(3)
    for axis in range(3):
        tx_mid[axis], rx_mid[axis] = tx[:, axis].mean(), rx[:, axis].mean()
    weight, path = np.zeros(len(points)), np.zeros(len(points))
    for i in range(len(points)):
        if by_tx[i]:
            weight[i], path[i] = _weight(points[i], normals[i], tx_mid, rx_mid, by_rx[i], lobe)
            weight[i] *= root_area[i]
    used = np.flatnonzero(weight > _WEAKEST * weight.max())
    steered = tx_steered.mean() + rx_steered.mean()
    sent = np.zeros(len(tx_share), np.complex128)
    heard = np.zeros(len(rx_share), np.complex128)
    banded = np.zeros(len(band_share), np.complex128)
    out = np.zeros((len(used), len(sent) * len(heard) * len(banded)), np.complex64)
    for row in range(len(used)):
        i = used[row]
        _add_phases(points[i], tx, tx_steered, tx_block, tx_share, middle_k, sent)
        _add_phases(points[i], rx, rx_steered, rx_block, rx_share, middle_k, heard)
        # Across the band only the length of the path counts, not that within the arrays.
        late = path[i] - steered
        turn = complex(math.cos(step_k * late), -math.sin(step_k * late))
        start = (first_k - middle_k) * late
        wave = complex(math.cos(start), -math.sin(start))
        banded[:] = 0.0
        for f in range(len(band)):
            if band[f] >= 0:
                banded[band[f]] += wave * band_share[band[f]]
            wave *= turn
        e = 0
        for a in range(len(sent)):
            for b in range(len(heard)):
                both = weight[i] * sent[a] * heard[b]
                for f in range(len(banded)):
                    out[row, e] = both * banded[f]
                    e += 1
    return out
