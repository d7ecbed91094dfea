# SPDX-License-Identifier: Apache-2.0
"""How fast things move, read from the channel's change over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import hann

#: Velocities per width of a spectral line.
_OVERSAMPLING = 2.0
#: Samples further apart than this, in units of the sampling interval, belong to other runs.
_GAP = 1.5


@dataclass(frozen=True)
class Spectrogram:
    """Power over velocity and time."""

    power: Float64[np.ndarray, "velocity time"]
    """A scatterer of constant velocity and amplitude A peaks at A²."""
    velocity_m_s: Float64[np.ndarray, "velocity"]
    """Half the rate at which the path gets shorter [m/s], ascending; positive approaches. For a
    radar whose antennas stand together it is the speed towards it."""
    time_s: Float64[np.ndarray, "time"]
    """Centre of each window [s]."""


def micro_doppler(
    change: Complex[np.ndarray, "time *links subcarrier"],
    time_s: Float64[np.ndarray, "time"],
    freq_hz: Float64[np.ndarray, "subcarrier"],
    *,
    window_s: float = 0.2,
    velocity_limit_m_s: float | None = None,
) -> Spectrogram:
    """Short-time spectra of a channel, velocity by time.

    A scatterer whose path of length d changes turns subcarrier f by e^{−j2πfd/c}: at v = −ḋ/2 its
    Doppler shift is 2vf/c. Each subcarrier is analysed at its own wavelength, Hann windows overlap
    by three quarters, and powers are averaged over links and subcarriers.

    Args:
        change: `csi − csi_static` (or csi less its mean over time), any axes of links between
            time and subcarriers; choose one device pair, as other pairs see other velocities.
        time_s: Time of each sample [s]. Evenly spaced, or in evenly spaced runs such as bursts
            of chirps; no window crosses a gap.
        freq_hz: Subcarrier frequencies [Hz].
        window_s: Length of a window [s], cut to the length of a run. Velocities are resolved
            by c/(2f · window_s).
        velocity_limit_m_s: Largest speed shown [m/s]; None takes the largest that is not
            aliased, c/(4f · interval).

    Raises:
        RfgsError: No run has at least four samples.
    """
    interval_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    runs = np.split(np.arange(len(time_s)), np.flatnonzero(np.diff(time_s) > _GAP * interval_s) + 1)
    longest = max(len(run) for run in runs)
    if longest < 4:
        raise RfgsError(
            "Doppler needs at least 4 evenly spaced samples in a row; make the dataset with "
            "rfgs-factory generate --packets-per-frame N"
        )
    size = min(longest, max(4, round(window_s / interval_s)))
    hop = max(1, size // 4)
    starts = [first for run in runs for first in run[: len(run) - size + 1 : hop]]
    wavelength_m = SPEED_OF_LIGHT / freq_hz
    limit = velocity_limit_m_s or float(wavelength_m.max()) / (4.0 * interval_s)
    line = float(wavelength_m.mean()) / (2.0 * size * interval_s)
    velocity = np.linspace(-limit, limit, 2 * int(np.ceil(_OVERSAMPLING * limit / line)) + 1)
    window = hann(size)
    window /= window.sum()
    times = np.arange(size) * interval_s
    samples = change.reshape(len(time_s), -1, len(freq_hz))
    power = np.zeros((len(velocity), len(starts)))
    for subcarrier, wavelength in enumerate(wavelength_m):
        turn = np.exp(-4j * np.pi / wavelength * np.outer(velocity, times)) * window
        for column, first in enumerate(starts):
            spectrum = turn @ samples[first : first + size, :, subcarrier]
            power[:, column] += (np.abs(spectrum) ** 2).mean(axis=1)
    centres = np.asarray(time_s)[starts] + 0.5 * (size - 1) * interval_s
    return Spectrogram(power / len(freq_hz), velocity, centres)
