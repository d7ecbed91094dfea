# SPDX-License-Identifier: Apache-2.0
"""Kriging with phase: a Gaussian process whose covariance turns as the wave does.

Covariance between positions x and x' on an array (or between subcarriers):

    k(x − x') = σ² exp(jω(x − x')) (exp(−(x − x')² / 2ℓ²) + ν δ),

a squared exponential that carries the mean direction of arrival (or mean delay) as its phase
slope ω. ω comes from neighbouring values, ℓ and ν from the marginal likelihood (Rasmussen &
Williams, Gaussian Processes for Machine Learning, eq. 2.30) over a small grid, σ in closed form.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rfgs_core.evaluate.baselines.interpolation import interpolating_baseline
from rfgs_core.evaluate.evidence import BaselineResult, Evidence

#: Correlation lengths tried, in steps of the coordinate.
LENGTHS = (0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 40.0)
#: Noise powers tried, relative to the signal; what is nearly all noise is predicted as nothing.
NOISES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0)
#: Correlation length of levels between device pairs, as a share of their mean distance.
LEVEL_LENGTH = 1.0
LEVEL_NOISE = 0.1


@lru_cache(maxsize=64)
def _spectrum(known: tuple[float, ...], length: float) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and eigenvectors of the squared-exponential covariance."""
    x = np.asarray(known)
    return np.linalg.eigh(np.exp(-((x[:, None] - x) ** 2) / (2.0 * length**2)))


def _slope(values: np.ndarray, x: np.ndarray) -> float:
    """Mean phase step per unit of x between neighbours one unit apart [rad]."""
    next_to = np.flatnonzero(np.isclose(np.diff(x), 1.0))
    return float(np.angle(np.vdot(values[next_to], values[next_to + 1])))


def krige(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Posterior mean at the wanted coordinates of the covariance above.

    Args:
        values: Complex values, shape (known, sample); the samples share one covariance.
        known: Ascending coordinates, shape (known, 1).
        wanted: Coordinates to predict, shape (wanted, 1).

    Returns:
        Shape (wanted, sample).
    """
    x, at = known[:, 0], wanted[:, 0]
    if len(x) < 2 or not np.any(values):
        return np.repeat(values[:1], len(at), axis=0)
    omega = _slope(values, x)
    still = values * np.exp(-1j * omega * x)[:, None]
    best: tuple[float, np.ndarray] | None = None
    for length in LENGTHS:
        eigenvalue, basis = _spectrum(tuple(x.tolist()), length)
        projected = np.mean(np.abs(basis.T @ still) ** 2, axis=1)
        for noise in NOISES:
            total = np.maximum(eigenvalue, 0.0) + noise
            # −log likelihood per sample with σ² profiled out.
            cost = len(x) * np.log(np.mean(projected / total)) + np.sum(np.log(total))
            if best is None or cost < best[0]:
                cross = np.exp(-((at[:, None] - x) ** 2) / (2.0 * length**2))
                best = (float(cost), (cross @ basis / total) @ basis.T)
    assert best is not None
    return (np.exp(1j * omega * at)[:, None] * (best[1] @ still)).astype(values.dtype)


def krige_level(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Posterior mean of levels [dB] around their mean, by distance between device pairs."""
    between = np.linalg.norm(known[:, None] - known, axis=-1)
    length = LEVEL_LENGTH * max(float(between.mean()), 1e-6)
    prior = np.exp(-(between**2) / (2 * length**2)) + LEVEL_NOISE * np.eye(len(known))
    cross = np.exp(-(np.linalg.norm(wanted[:, None] - known, axis=-1) ** 2) / (2 * length**2))
    mean = values.mean(axis=0)
    return mean + cross @ np.linalg.solve(prior, values - mean)


def baseline(evidence: Evidence) -> BaselineResult:
    """Kriges array columns and subcarriers with phase, and levels between device pairs."""
    return interpolating_baseline(evidence, krige, krige_level)
