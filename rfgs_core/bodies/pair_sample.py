# SPDX-License-Identifier: Apache-2.0
"""Entries of a device pair drawn by chance, and how likely Gaussians of equal power make them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.lapack import product_with_itself
from rfgs_core.limbs.evidence.kernel import log_evidence
from rfgs_core.measure.observations import Observations
from rfgs_core.model.head import SHARPNESS
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.vector_math import FAST_MATH, exponential, sine_cosine_of_turns

#: Links that are read of a pair; the other entries are subcarriers.
LINKS = 32
#: Shares of noise that are tried, against the mean power of the echoes.
NOISE_SHARES = 10.0 ** np.arange(-3.0, 1.01, 0.25)


@dataclass(frozen=True)
class PairSample:
    """Some visible links and subcarriers of one device pair."""

    tx_xyz: Float64[np.ndarray, "link 3"]
    """Transmitting elements [m]."""
    rx_xyz: Float64[np.ndarray, "link 3"]
    """Receiving elements [m]."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Subcarriers [Hz]."""
    change: Complex64[np.ndarray, "entry"]
    """Channel change of these links and subcarriers, subcarriers fastest."""

    def log_likelihood(
        self, points: Float64[np.ndarray, "M 3"], normals: Float64[np.ndarray, "M 3"]
    ) -> float:
        """Log evidence of Gaussians of equal power, at their best level and share of noise [nat].

        Zero where nothing is heard, which speaks for no posture.
        """
        per_m = self.freq_hz / SPEED_OF_LIGHT
        rows = _responses(self.tx_xyz, self.rx_xyz, per_m, points.T.copy(), normals.T.copy())
        return log_evidence(self.change, product_with_itself(rows), shares=NOISE_SHARES)


def pair_samples(observations: Observations, entries: int, seed: int) -> list[PairSample]:
    """Entries of each device pair, drawn by chance, in units of their root mean square.

    Args:
        observations: The frame.
        entries: About how many to draw of a pair.
        seed: Seed of what is drawn.
    """
    rng = np.random.default_rng(seed)
    pair, names = observations.pairs
    visible = np.flatnonzero(observations.subcarriers)
    result = []
    for index in range(len(names)):
        tx, rx = np.nonzero(pair == index)
        count = min(len(tx), LINKS)
        link = np.sort(rng.choice(len(tx), count, replace=False))
        subcarrier = rng.choice(visible, min(len(visible), max(entries // count, 4)), replace=False)
        tx, rx, subcarrier = tx[link], rx[link], np.sort(subcarrier)
        change = observations.delta[tx[:, None], rx[:, None], subcarrier].ravel()
        scale = np.sqrt(np.mean(np.abs(change) ** 2)) or 1.0
        ends = observations.layout.tx_xyz[tx], observations.layout.rx_xyz[rx]
        freq_hz = observations.freq_hz[subcarrier]
        result.append(PairSample(*ends, freq_hz, (change / scale).astype(np.complex64)))
    return result


@numba.njit(forceinline=True, cache=True, nogil=True, fastmath=FAST_MATH, error_model="numpy")
def _leg(antenna: np.ndarray, x: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of Gaussians from an antenna [m], and visibility over distance."""
    away, seen = np.zeros(x.shape[1]), np.zeros(x.shape[1], np.float32)
    for i in range(x.shape[1]):
        p, q, r = antenna[0] - x[0, i], antenna[1] - x[1, i], antenna[2] - x[2, i]
        away[i] = math.sqrt(p * p + q * q + r * r)
        facing = (p * normal[0, i] + q * normal[1, i] + r * normal[2, i]) / away[i]
        dimming = np.float32(1.0) + exponential(np.float32(-SHARPNESS * facing))
        seen[i] = np.float32(1.0) / (np.float32(away[i]) * dimming)
    return away, seen


@numba.njit(cache=True, nogil=True, fastmath=FAST_MATH, error_model="numpy")
def _responses(
    tx: np.ndarray, rx: np.ndarray, per_m: np.ndarray, x: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Conjugates of the propagation model's answers to Gaussians of γ = 1, (entry, Gaussian).

    Without their factor λ/(4π)^{3/2}, which hardly differs within a band: levels are fitted.
    """
    count, bands = x.shape[1], len(per_m)
    out = np.zeros((len(tx) * bands, 2 * count), np.float32)
    for link in range(len(tx)):
        out_m, lit = _leg(tx[link], x, normal)
        back_m, heard = _leg(rx[link], x, normal)
        path, weight = out_m + back_m, lit * heard
        for band in range(bands):
            row, scale = out[link * bands + band], per_m[band]
            for i in range(count):
                turns = scale * path[i]
                # Whole turns go in double precision: paths have thousands of wavelengths.
                sine, cosine = sine_cosine_of_turns(np.float32(turns - np.floor(turns + 0.5)))
                row[2 * i], row[2 * i + 1] = weight[i] * cosine, weight[i] * sine
    return out.view(np.complex64)
