# SPDX-License-Identifier: Apache-2.0
"""Delay profiles of channels, and the windows that keep their side lobes down."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Complex, Float, Float64, Inexact, Int

from rfgs_core.radio.presets import Radio


def hann(count: int) -> Float64[np.ndarray, "subcarrier"]:
    """Hann window whose zeros lie one sample beyond its ends, so that each of them counts."""
    return np.hanning(count + 2)[1:-1]


def hann_to_zero(count: int) -> Float64[np.ndarray, "subcarrier"]:
    """Hann window that is zero at the band's first and last subcarrier."""
    return np.hanning(count)


def hann_between(count: int) -> Float64[np.ndarray, "subcarrier"]:
    """Hann window whose zeros lie half a subcarrier beyond the band: one period of a cosine."""
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(count) + 0.5) / count)


def band_window(
    subcarriers: Bool[np.ndarray, "subcarrier"],
    taper: Callable[[int], np.ndarray] = np.hamming,
) -> Float64[np.ndarray, "subcarrier"]:
    """Window over the whole band, zero at hidden subcarriers, sum 1."""
    window = taper(len(subcarriers)) * subcarriers
    return window / window.sum()


def delay_transform(
    values: Inexact[np.ndarray, "*link subcarrier"],
    size: int,
    place: Int[np.ndarray, "subcarrier"] | None = None,
) -> Complex[np.ndarray, "*link delay"]:
    """Inverse transform over subcarriers, Σ H_k e^{j2π k m / size} / size for each delay m.

    Args:
        values: Channels, windowed or not.
        size: Delays over one period 1/Δf.
        place: Number k of each subcarrier on the even grid that they stand on, negative below the
            one that phases refer to; 0, 1, 2, … if None.
    """
    if place is None:
        return np.fft.ifft(values, n=size, axis=-1)
    grid = np.zeros((*values.shape[:-1], size), values.dtype)
    grid[..., place % size] = values
    return np.fft.ifft(grid, axis=-1)


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
    response = delay_transform(csi * window, size)
    return response * size if peak else response


def path_lengths_m(radio: Radio, samples_per_subcarrier: int) -> Float64[np.ndarray, "delay"]:
    """Path length of each sample of a profile [m]."""
    count = samples_per_subcarrier * radio.num_subcarriers
    return np.arange(count) * radio.unambiguous_path_m / count
