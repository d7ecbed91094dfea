# SPDX-License-Identifier: Apache-2.0
"""Delay profiles of channels, and the windows that keep their side lobes down."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float, Float64

from rfgs_core.radio.presets import Radio


def hann(count: int) -> Float64[np.ndarray, "subcarrier"]:
    """Hann window whose zeros lie one subcarrier beyond the band, so that each of them counts."""
    return np.hanning(count + 2)[1:-1]


def hann_to_zero(count: int) -> Float64[np.ndarray, "subcarrier"]:
    """Hann window that is zero at the band's first and last subcarrier."""
    return np.hanning(count)


def hann_between(count: int) -> Float64[np.ndarray, "subcarrier"]:
    """Hann window whose zeros lie half a subcarrier beyond the band: one period of a cosine."""
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(count) + 0.5) / count)


def band_window(subcarriers: Bool[np.ndarray, "subcarrier"]) -> Float64[np.ndarray, "subcarrier"]:
    """Hamming window over the band, zero at hidden subcarriers, sum 1."""
    window = np.hamming(len(subcarriers)) * subcarriers
    return window / window.sum()


def delay_profile(
    csi: Complex[np.ndarray, "*link subcarrier"],
    window: Float[np.ndarray, "subcarrier"],
    samples_per_subcarrier: int = 1,
    *,
    peak: bool = False,
) -> Complex[np.ndarray, "*link delay"]:
    """Impulse responses of windowed channels over one period 1/Δf of delay.

    Args:
        csi: Channels at equally spaced subcarriers.
        window: Weight of each subcarrier.
        samples_per_subcarrier: How much finer than 1/B the delays are sampled.
        peak: Whether a path of amplitude a peaks at a Σ window; else at its mean over the samples.

    Returns:
        Sample m of `samples_per_subcarrier` · subcarriers stands for the delay m / (samples · Δf).
    """
    size = samples_per_subcarrier * len(window)
    response = np.fft.ifft(csi * window, n=size, axis=-1)
    return response * size if peak else response


def path_lengths_m(radio: Radio, samples_per_subcarrier: int) -> Float64[np.ndarray, "delay"]:
    """Path length of each sample of a profile [m]."""
    count = samples_per_subcarrier * radio.num_subcarriers
    return np.arange(count) * radio.unambiguous_path_m / count
