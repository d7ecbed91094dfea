# SPDX-License-Identifier: Apache-2.0
"""Kriging with the covariance of a spectrum: directions along arrays, delays over subcarriers.

Values at whole-numbered positions x are taken for a sum of waves exp(jωx) with independent
amplitudes of power p(ω), plus noise of power σ². Their covariance R = A diag(p) Aᴴ + σ²I has a
free shape, so echoes from several directions, or with several delays, are carried on each with a
phase of its own, where a covariance of one shape knows one. Powers are the likeliest ones
given the samples' covariance S, by the multiplicative steps

    p ← p √(aᴴR⁻¹SR⁻¹a / aᴴR⁻¹a),   σ² ← σ² √(tr R⁻¹SR⁻¹ / tr R⁻¹),

which raise the likelihood (LIKES: Stoica and Babu, Signal Processing 92(7), 2012). They are stopped
early, which keeps spectra smooth where there are few samples.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex128, Float64, Int64

#: Multiplicative steps; after more of them, noise becomes lines.
STEPS = 10
#: Frequencies ω per position, at least.
OVERSAMPLING = 4
#: Frequencies at least, for arrays of a few columns.
FEWEST = 64
#: Noise at the start, as a share of the power, and what is always added to it.
FIRST_NOISE, LEAST_NOISE = 0.1, 1e-9


def spectral(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Posterior mean at the wanted coordinates of the covariance above.

    Args:
        values: Complex values, shape (known, sample); the samples share one spectrum.
        known: Ascending whole numbers, shape (known, 1).
        wanted: Whole numbers to predict, shape (wanted, 1).

    Returns:
        Shape (wanted, sample).
    """
    first = min(known.min(), wanted.min())
    x, at = (np.rint(c[:, 0] - first).astype(np.int64) for c in (known, wanted))
    if len(x) < 2 or not np.any(values):
        return np.repeat(values[:1], len(at), axis=0)
    span = int(max(x.max(), at.max())) + 1
    size = max(FEWEST, 1 << int(np.ceil(np.log2(OVERSAMPLING * span))))
    samples = _like(values.astype(np.complex128))
    power, noise = _likeliest(samples, x, size)
    cross = _lags(power)[(at[:, None] - x) % size]
    mean = cross @ np.linalg.solve(_covariance(power, noise, x), values)
    return mean.astype(values.dtype)


def _like(
    values: Complex128[np.ndarray, "known sample"],
) -> Complex128[np.ndarray, "known some"]:
    """No more columns than rows, with the same covariance V Vᴴ / samples."""
    if values.shape[1] <= len(values):
        return values / np.sqrt(values.shape[1])
    level, basis = np.linalg.eigh(values @ values.conj().T / values.shape[1])
    return basis * np.sqrt(np.maximum(level, 0.0))


def _lags(power: Float64[np.ndarray, "size"]) -> Complex128[np.ndarray, "size"]:
    """Covariance at each distance of positions: Σ p exp(jωd)."""
    return np.fft.ifft(power) * len(power)


def _covariance(
    power: Float64[np.ndarray, "size"], noise: float, x: Int64[np.ndarray, "known"]
) -> Complex128[np.ndarray, "known known"]:
    return _lags(power)[(x[:, None] - x) % len(power)] + noise * np.eye(len(x))


def _likeliest(
    samples: Complex128[np.ndarray, "known some"], x: Int64[np.ndarray, "known"], size: int
) -> tuple[Float64[np.ndarray, "size"], float]:
    """Power at each ω and of the noise."""
    total = float(np.sum(np.abs(samples) ** 2)) / len(x)
    power, noise = np.full(size, (1 - FIRST_NOISE) * total / size), FIRST_NOISE * total
    distance = ((x[:, None] - x) % size).ravel()
    padded = np.zeros((size, samples.shape[1]), dtype=np.complex128)
    for _ in range(STEPS):
        inverse = np.linalg.inv(_covariance(power, noise, x))
        whitened = inverse @ samples
        padded[x] = whitened
        seen = np.sum(np.abs(np.fft.fft(padded, axis=0)) ** 2, axis=1)
        # Σ over all pairs of positions by their distance: aᴴR⁻¹a for all ω in one transform.
        flat = inverse.ravel()
        real, imaginary = (np.bincount(distance, part, size) for part in (flat.real, flat.imag))
        expected = np.fft.fft(real + 1j * imaginary).real
        power = power * np.sqrt(seen / np.maximum(expected, 1e-300))
        trace = float(np.trace(inverse).real)
        noise = noise * np.sqrt(float(np.sum(np.abs(whitened) ** 2)) / trace)
        noise = max(noise, LEAST_NOISE * total)
    return power, noise
