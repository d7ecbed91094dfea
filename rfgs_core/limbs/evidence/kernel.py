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
from rfgs_core.limbs.evidence.responses import responses, wide_responses

#: Shares of noise that are tried, against the mean power of the echoes.
NOISE_SHARES = 10.0 ** np.arange(-2.5, 1.01, 0.5)
#: Arrays that, from the middle of the band to its end, are wider by more than this [rad] have
#: other beams at each part of it.
_TURNING_RAD = 1.5


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
    ends = (
        tx.xyz, rx.xyz, tx.steered_m, rx.steered_m, tx.block, rx.block, tx.share, rx.share
    )  # fmt: skip
    if max(_width_m(tx.xyz), _width_m(rx.xyz)) * bands.half_k > _TURNING_RAD:
        rows = wide_responses(
            *facets, by_tx, by_rx, *images, *ends,
            bands.first_k, bands.step_k, bands.block, bands.share, lobe_rad,
        )  # fmt: skip
    else:
        rows = responses(*facets, by_tx, by_rx, *images, *ends, *bands, lobe_rad)
    return product_with_itself(rows)


def _width_m(xyz: Float64[np.ndarray, "element 3"]) -> float:
    """How wide an array is, along the axes of the world [m]."""
    return float(np.linalg.norm(np.ptp(xyz, axis=0)))


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
