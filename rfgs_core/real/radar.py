# SPDX-License-Identifier: Apache-2.0
"""Acconeer A121: how fast somebody breathes, and how far a reflector is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float

from rfgs_core.capture import Capture, read_capture
from rfgs_core.errors import RfgsFormatError

#: Breaths per second of people at rest.
BREATHING_HZ = (0.1, 0.6)
#: Padding of spectra.
_PADDING = 16


def judge_breathing(path: Path) -> dict[str, float | str]:
    """Breaths per minute by the phase of the points that move, and by amplitude alone.

    There is no ground truth beside the recording. What can be told is how far the peak stands
    above the rest of the band, and whether both halves of the recording agree.

    Returns:
        For each way breaths per minute, peak over median [dB], difference of the halves.
    """
    capture = read_capture(path).largest
    frames, rate_hz = _frames(capture)
    result: dict[str, float | str] = {"recording_s": len(frames) / rate_hz}
    for name, series in (("amplitude", _loudest_amplitude), ("ours", _displacement)):
        found, above_db = _peak(series(frames), rate_hz)
        halves = [_peak(series(half), rate_hz)[0] for half in np.array_split(frames, 2)]
        result[f"{name}_breaths_per_min"] = 60.0 * found
        result[f"{name}_peak_db"] = above_db
        result[f"{name}_halves_differ_per_min"] = 60.0 * abs(halves[0] - halves[1])
    return result


def judge_reflector(path: Path) -> dict[str, float | str]:
    """Range of a reflector by the highest point, and by a parabola through its neighbours.

    There is no surveyed range; the spread over frames tells the precision.
    """
    capture = read_capture(path).largest
    segment = np.asarray(capture.info["segment"])
    use = np.flatnonzero(segment == np.bincount(segment).argmax())
    level = np.abs(capture.values[:, 0, 0, 0][:, use])
    range_m, step_m = capture.bins[use], float(np.median(np.diff(capture.bins[use])))
    top = np.clip(level.argmax(axis=1), 1, len(use) - 2)
    rows = np.arange(len(level))
    below, middle, above = (np.log(level[rows, top + k] + 1e-9) for k in (-1, 0, 1))
    bend = np.minimum(below - 2 * middle + above, -1e-9)
    fine_m = range_m[top] + 0.5 * step_m * (below - above) / bend
    return {
        "highest_point_m": float(range_m[top].mean()),
        "highest_point_deviation_m": float(range_m[top].std()),
        "ours_m": float(fine_m.mean()),
        "ours_deviation_m": float(fine_m.std()),
        "step_m": step_m,
    }


def _frames(capture: Capture) -> tuple[Complex[np.ndarray, "frame point"], float]:
    """Sweeps of a frame averaged, and frames per second."""
    sweeps = int(capture.info["sweeps_per_frame"])
    frames = capture.values[:, 0, 0, 0].reshape(-1, sweeps, len(capture.bins)).mean(axis=1)
    span_s = float(capture.time_s[-1] - capture.time_s[0])
    if len(frames) < 32 or span_s <= 0:
        raise RfgsFormatError("acconeer: expected at least 32 frames with times")
    return frames, (len(frames) - 1) / float(capture.time_s[(len(frames) - 1) * sweeps])


def _loudest_amplitude(frames: Complex[np.ndarray, "frame point"]) -> Float[np.ndarray, "frame"]:
    """Amplitude at the loudest point."""
    return np.abs(frames[:, np.abs(frames).mean(axis=0).argmax()])


def _displacement(frames: Complex[np.ndarray, "frame point"]) -> Float[np.ndarray, "frame"]:
    """First principal component of real and imaginary parts of all points.

    Linear demodulation: of a chest that moves by less than a quarter of the wavelength the
    fundamental is the largest line, whatever the phase of what stands still around it.
    """
    moving = frames - frames.mean(axis=0)
    parts = np.concatenate([moving.real, moving.imag], axis=1)
    _, _, axes = np.linalg.svd(parts, full_matrices=False)
    return parts @ axes[0]


def _peak(series: Float[np.ndarray, "frame"], rate_hz: float) -> tuple[float, float]:
    """Frequency of the highest line in the band [Hz], and its height over the median [dB]."""
    from scipy.signal import butter, sosfiltfilt

    from rfgs_core.radio.levels import decibels

    size = _PADDING * len(series)
    # People who come and go leave a drift that would stand at the band's lower edge.
    high = butter(2, BREATHING_HZ[0], "highpass", fs=rate_hz, output="sos")
    windowed = sosfiltfilt(high, series) * np.hanning(len(series))
    power = np.abs(np.fft.rfft(windowed, n=size)) ** 2
    freq_hz = np.fft.rfftfreq(size, 1.0 / rate_hz)
    band = (freq_hz >= BREATHING_HZ[0]) & (freq_hz <= BREATHING_HZ[1])
    inside = power[band]
    height = float(inside.max() / max(float(np.median(power[1:])), 1e-300))
    return float(freq_hz[band][inside.argmax()]), float(decibels(height))
