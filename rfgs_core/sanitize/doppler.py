# SPDX-License-Identifier: Apache-2.0
"""What moves: the band of a walking person's Doppler shifts, and their spectrum over time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float, Float64


def doppler_band(
    values: Complex[np.ndarray, "time *link"],
    rate_hz: float,
    low_hz: float = 2.0,
    high_hz: float = 60.0,
) -> Complex[np.ndarray, "time *link"]:
    """Keeps Doppler shifts from 2 to 60 Hz, Butterworth of order 6 (low pass) and 3 (high pass).

    Source: `get_doppler_spectrum.m` of Widar 3.0, whose filters run forward only and shift time;
    here they run both ways (`sosfiltfilt`), so their slopes are twice as steep and time stays.

    Args:
        values: Regularly sampled series.
        rate_hz: Their rate.
        low_hz: Lower edge; 0 keeps what stands still.
        high_hz: Upper edge, left out where the rate is too low for it.
    """
    from scipy.signal import butter, sosfiltfilt

    kept = values
    if high_hz < 0.5 * rate_hz:
        kept = sosfiltfilt(butter(6, high_hz, fs=rate_hz, output="sos"), kept, axis=0)
    if low_hz > 0:
        high = butter(3, low_hz, "highpass", fs=rate_hz, output="sos")
        kept = sosfiltfilt(high, kept, axis=0)
    return np.asarray(kept).astype(values.dtype)


def first_component(values: Complex[np.ndarray, "time link"]) -> Complex[np.ndarray, "time"]:
    """First principal component over links, the motion that they share (CARM, Wang et al. 2015)."""
    centred = values - values.mean(axis=0)
    covariance = np.conj(centred).T @ centred
    _, vectors = np.linalg.eigh(covariance)
    return centred @ vectors[:, -1]


def doppler_spectrum(
    series: Complex[np.ndarray, "time"], rate_hz: float, window_s: float = 0.25
) -> tuple[
    Float64[np.ndarray, "doppler"], Float64[np.ndarray, "slice"], Float[np.ndarray, "doppler slice"]
]:
    """Power over Doppler shift and time: short-time Fourier transform with a Gaussian window.

    Args:
        series: One regularly sampled series.
        rate_hz: Its rate.
        window_s: Length of the window, four standard deviations [s].

    Returns:
        Doppler shifts [Hz] ascending, odd in number, times [s] and |STFT|².
    """
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import gaussian

    size = max(int(window_s * rate_hz) | 1, 3)
    transform = ShortTimeFFT(
        gaussian(size, size / 4.0),
        hop=max(size // 8, 1),
        fs=rate_hz,
        fft_mode="centered",
        mfft=max(255, 2 * size + 1),
    )
    power = np.abs(transform.stft(series)) ** 2
    times_s = transform.t(len(series))
    inside = (times_s >= 0) & (times_s <= len(series) / rate_hz)
    return transform.f, times_s[inside], power[:, inside]
