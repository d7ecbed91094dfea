# SPDX-License-Identifier: Apache-2.0
"""Captures as channels on a grid of equally spaced subcarriers, as datasets hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.capture.model import Capture
from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.sanitize.gaps import fill_gaps

#: Deviation of a grid from equal spacing that counts as rounding, in steps.
_UNEVEN = 0.02


@dataclass(frozen=True)
class Channels:
    """Channels of one device over equally spaced subcarriers."""

    values: Complex64[np.ndarray, "time rx tx subcarrier"]
    """Channels; subcarriers that were not measured are filled from their neighbours."""
    measured: Bool[np.ndarray, "subcarrier"]
    """Subcarriers that were measured in every packet."""
    place: Int64[np.ndarray, "bin"]
    """Subcarrier of each bin of the capture; of delays and ranges there is none."""
    first_hz: float
    """Lowest subcarrier [Hz], from the centre where the file tells none."""
    spacing_hz: float
    """Distance of subcarriers [Hz]."""

    @property
    def freq_hz(self) -> Float64[np.ndarray, "subcarrier"]:
        """Frequencies [Hz]."""
        return self.first_hz + self.spacing_hz * np.arange(len(self.measured))


def channels_of(capture: Capture, device: int = 0, centre_hz: float | None = None) -> Channels:
    """Puts one device's channels on the finest even grid that holds all its bins.

    Delays and ranges become subcarriers by H(f) = Σ h(τ) e^{−j2π(f − f_c)τ}, with τ = 2 r/c of a
    range r; as many subcarriers as bins, so that nothing is lost.

    Args:
        capture: What a reader gave.
        device: Which of its devices.
        centre_hz: Centre of the channel where the file does not tell it.

    Raises:
        RfgsFormatError: The centre is known from neither side, the bins are not evenly spaced, or
            the capture holds powers without phases.
    """
    centre_hz = capture.centre_hz if capture.centre_hz is not None else centre_hz
    if centre_hz is None:
        raise RfgsFormatError(
            f"{capture.source}: the file does not tell its channel; give centre_hz in --layout"
        )
    values, valid = capture.values[:, device], capture.valid[:, device]
    if capture.axis == "direction":
        raise RfgsFormatError(
            f"{capture.source}: spectra hold powers without phases, of which no channels come"
        )
    if capture.axis != "subcarrier":
        return _transformed(capture, values, centre_hz)
    bins = len(capture.bins)
    if bins == 1:
        # One frequency: a slice of it as wide as a Wi-Fi channel stands for it.
        everywhere = np.ones(1, bool)
        return Channels(values, everywhere, np.zeros(1, np.int64), centre_hz, 20e6)
    spacing_hz, place = _even(capture)
    count = int(place[-1]) + 1
    whole = np.zeros((*values.shape[:-1], count), np.complex64)
    known = np.zeros(whole.shape, bool)
    whole[..., place], known[..., place] = values, valid
    filled = fill_gaps(whole, known, np.arange(count)).astype(np.complex64)
    # What a reader filled itself stays as it gave it.
    filled[..., place] = np.where(valid | (values != 0), values, filled[..., place])
    heard = known.any(axis=-1)
    measured = known[heard].all(axis=0) if heard.any() else known.any(axis=(0, 1, 2))
    return Channels(filled, measured, place, centre_hz + float(capture.bins[0]), spacing_hz)


def _even(capture: Capture) -> tuple[float, Int64[np.ndarray, "bin"]]:
    """Spacing [Hz] of the finest even grid, and the place of each bin on it."""
    if capture.index[-1] - capture.index[0] > 0:
        step = int(np.gcd.reduce(np.diff(capture.index)))
        place = (capture.index - capture.index[0]) // max(step, 1)
        spacing_hz = float(capture.bins[-1] - capture.bins[0]) / int(place[-1])
        even = capture.bins[0] + spacing_hz * place
        if spacing_hz > 0 and np.abs(even - capture.bins).max() < _UNEVEN * spacing_hz:
            return spacing_hz, place.astype(np.int64)
    raise RfgsFormatError(f"{capture.source}: expected evenly spaced frequencies, found others")


def _transformed(capture: Capture, values: np.ndarray, centre_hz: float) -> Channels:
    """Subcarriers of impulse responses or range profiles."""
    use = _longest_even_run(capture)
    kept = capture.bins[use]
    if len(kept) < 2:
        raise RfgsFormatError(f"{capture.source}: expected at least two evenly spaced bins")
    delay_s = 2.0 * kept / SPEED_OF_LIGHT if capture.axis == "range" else kept
    step_s = float(delay_s[-1] - delay_s[0]) / (len(kept) - 1)
    count, spacing_hz = len(kept), 1.0 / (step_s * len(kept))
    offset_hz = (np.arange(count) - count // 2) * spacing_hz
    spectrum = np.fft.fftshift(np.fft.fft(values[..., use], axis=-1), axes=-1)
    spectrum = spectrum * np.exp(-2j * np.pi * offset_hz * delay_s[0])
    return Channels(
        spectrum.astype(np.complex64),
        np.ones(count, bool),
        np.zeros(0, np.int64),
        centre_hz + float(offset_hz[0]),
        spacing_hz,
    )


def _longest_even_run(capture: Capture) -> Int64[np.ndarray, "kept"]:
    """The most bins of one segment of the radar's sweep that are evenly spaced."""
    segment = np.asarray(capture.info.get("segment", np.zeros(len(capture.bins))))
    best = np.zeros(0, np.int64)
    for number in np.unique(segment):
        bins = np.flatnonzero(segment == number)
        step = np.diff(capture.bins[bins])
        start = 0
        for end in range(1, len(bins)):
            if end == len(step) or abs(step[end] - step[start]) > _UNEVEN * abs(step[start]):
                if end + 1 - start > len(best):
                    best = bins[start : end + 1]
                start = end
    return best
