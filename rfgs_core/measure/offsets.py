# SPDX-License-Identifier: Apache-2.0
"""Phase and timing offsets of devices, from channels beside what they should be.

A device whose oscillator is φ ahead and whose clock is τ late turns every link from it to
another device b by exp(j(φ_a − φ_b) − j2π(f − f_c)(τ_a − τ_b)), f_c the centre of the subcarriers;
links within a device stay as they are. Given channels y and a model m of them, the likelihood under
white noise depends on the cross spectra c_ab(f) = Σ_links y m* of the device pairs alone:

    J(φ, τ) = Σ_ab w_ab Re Σ_f c_ab(f) exp(−j(φ_a − φ_b) + j2π(f − f_c)(τ_a − τ_b)).

Only differences between devices matter; device 0 is the reference. Both directions of a pair
enter, so an error of the model that is the same both ways (reciprocity) cancels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Complex128, Float64, Int64
from scipy.optimize import minimize

from rfgs_core.errors import RfgsError
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import Layout
from rfgs_core.radio.delay import delay_transform

#: Delay samples per resolution cell 1/B of the first guess.
OVERSAMPLING = 16
#: Rounds of weighting pairs by what the offsets explain of them.
REWEIGHTED = 3
#: Share of its power that is noise to any model, at least.
LEAST_NOISE = 1e-3
#: Rounds of reweighting that keep single wrong delays out of the first guess.
ROUNDS = 20


@dataclass(frozen=True)
class Offsets:
    """What every device adds to its links; device 0 is the reference, all zero."""

    phase_rad: Float64[np.ndarray, "device"]
    """How far ahead each device's oscillator is [rad], in (−π, π]."""
    delay_s: Float64[np.ndarray, "device"]
    """How late each device's clock is [s]."""

    @staticmethod
    def none(layout: Layout) -> Offsets:
        """No offsets for the devices of a layout."""
        count = 1 + int(max(layout.tx_device.max(), layout.rx_device.max()))
        return Offsets(np.zeros(count), np.zeros(count))

    def __add__(self, other: Offsets) -> Offsets:
        phase_rad = np.angle(np.exp(1j * (self.phase_rad + other.phase_rad)))
        return Offsets(phase_rad, self.delay_s + other.delay_s)

    def turn(
        self, layout: Layout, freq_hz: Float64[np.ndarray, "subcarrier"]
    ) -> Complex128[np.ndarray, "tx rx subcarrier"]:
        """Factor of modulus one by which the devices turn every link."""
        a, b = layout.tx_device[:, None], layout.rx_device[None, :]
        baseband = 2 * np.pi * (freq_hz - freq_hz.mean())
        phase = (self.phase_rad[a] - self.phase_rad[b])[..., None]
        return np.exp(1j * (phase - (self.delay_s[a] - self.delay_s[b])[..., None] * baseband))

    def undone(self, observations: Observations) -> Observations:
        """Observations as devices without these offsets would have made them."""
        back = np.conj(self.turn(observations.layout, observations.freq_hz))
        return replace(
            observations,
            delta=(observations.delta * back).astype(np.complex64),
            static=(observations.static * back).astype(np.complex64),
        )


@dataclass(frozen=True)
class CrossSpectra:
    """Cross spectra of the pairs of different devices, each in units of its own power."""

    value: Complex128[np.ndarray, "pair subcarrier"]
    """c_ab over the visible subcarriers."""
    first: Int64[np.ndarray, "pair"]
    """Transmitting device of each pair."""
    second: Int64[np.ndarray, "pair"]
    """Receiving device of each pair."""
    baseband: Float64[np.ndarray, "subcarrier"]
    """2π(f − f_c) of the visible subcarriers [rad/s]."""
    index: Int64[np.ndarray, "subcarrier"]
    """Place of the visible subcarriers among all."""

    @staticmethod
    def of(
        observations: Observations,
        measured: Complex[np.ndarray, "tx rx subcarrier"],
        model: Complex[np.ndarray, "tx rx subcarrier"],
    ) -> CrossSpectra:
        """Cross spectra of the visible entries.

        Raises:
            RfgsError: The visible links do not connect all devices to each other.
        """
        pair, names = observations.pairs
        subcarriers = observations.subcarriers
        rows, kept = [], []
        for index, (a, b) in enumerate(names):
            if a == b:
                continue
            y = measured[pair == index][:, subcarriers].astype(np.complex128)
            m = model[pair == index][:, subcarriers].astype(np.complex128)
            scale = np.sqrt(np.sum(np.abs(y) ** 2) * np.sum(np.abs(m) ** 2))
            if scale > 0:
                rows.append(np.sum(y * np.conj(m), axis=0) / scale)
                kept.append((a, b))
        first, second = np.array(kept, dtype=np.int64).reshape(-1, 2).T
        _check_connected(observations.layout, first, second)
        freq_hz = observations.freq_hz
        return CrossSpectra(
            value=np.array(rows),
            first=first,
            second=second,
            baseband=2 * np.pi * (freq_hz - freq_hz.mean())[subcarriers],
            index=np.flatnonzero(subcarriers),
        )

    def weighted(self, offsets: Offsets, pooled: bool) -> CrossSpectra:
        """Spectra in units of what offsets leave unexplained of each pair.

        With ρ the coherence of a pair once its offsets are taken out, a share 1 − ρ² of its
        power is noise to this model; pooled, the mean share of all pairs.
        """
        lag = offsets.delay_s[self.first] - offsets.delay_s[self.second]
        turned = np.sum(self.value * np.exp(1j * np.outer(lag, self.baseband)), axis=1)
        noise = np.maximum(1 - np.abs(turned) ** 2, LEAST_NOISE)
        if pooled:
            noise = np.full_like(noise, noise.mean())
        return replace(self, value=self.value / noise[:, None])

    @staticmethod
    def join(parts: Sequence[CrossSpectra]) -> CrossSpectra:
        """All pairs of parts with the same subcarriers, for offsets that have to suit them all."""
        names = ("value", "first", "second")
        rows = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return replace(parts[0], **rows)


def estimate_offsets(
    *models: CrossSpectra, phase: bool = True, timing: bool = True, pooled: bool = False
) -> Offsets:
    """The likeliest offsets, device 0 being the reference.

    Args:
        models: Cross spectra of channels, beside one model or several.
        phase: Whether oscillators may differ; without, phases are estimated all the same, as
            a nuisance, and left out of the result.
        timing: Whether clocks may differ; without, they are taken to agree.
        pooled: Whether all pairs of a model count as equally noisy. A model that lacks something
            is off by a phase that a pair's own coherence need not show; that of all pairs does.
    """
    found = _likeliest(CrossSpectra.join(models), phase=phase, timing=timing)
    for _ in range(REWEIGHTED):
        weighted = CrossSpectra.join([model.weighted(found, pooled) for model in models])
        found = _likeliest(weighted, phase=phase, timing=timing)
    return found


def _likeliest(spectra: CrossSpectra, *, phase: bool, timing: bool) -> Offsets:
    """The offsets that maximise J for given weights."""
    devices = 1 + int(max(spectra.first.max(), spectra.second.max()))
    bandwidth = float(np.ptp(spectra.baseband))
    delay = _first_delays(spectra, devices) if timing else np.zeros(devices)
    angle = _first_phases(spectra, delay)

    # Phases in radians and delays in radians across the band: both of order one.
    def split(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        offset = np.concatenate([[0.0], x[: devices - 1]])
        late = np.concatenate([[0.0], x[devices - 1 :]]) / bandwidth if timing else delay
        return offset, late

    def cost(x: np.ndarray) -> tuple[float, np.ndarray]:
        offset, late = split(x)
        lag = late[spectra.first] - late[spectra.second]
        ahead = offset[spectra.first] - offset[spectra.second]
        turned = spectra.value * np.exp(1j * (np.outer(lag, spectra.baseband) - ahead[:, None]))
        by_phase = turned.imag.sum(axis=1)
        by_delay = -(turned.imag @ spectra.baseband) / bandwidth
        parts = [_per_device(spectra, by_phase, devices)[1:]]
        parts += [_per_device(spectra, by_delay, devices)[1:]] if timing else []
        return -float(turned.real.sum()), -np.concatenate(parts)

    start = np.concatenate([angle[1:], (delay * bandwidth)[1:] if timing else []])
    found = minimize(cost, start, jac=True, method="BFGS", options={"gtol": 1e-10})
    offset, late = split(found.x)
    wrapped = np.angle(np.exp(1j * offset)) if phase else np.zeros(devices)
    return Offsets(wrapped, late)


def _per_device(spectra: CrossSpectra, slope: np.ndarray, devices: int) -> np.ndarray:
    """Sums slopes by x_a − x_b per pair into slopes by x of each device."""
    sent = np.bincount(spectra.first, slope, devices)
    return sent - np.bincount(spectra.second, slope, devices)


def _first_delays(spectra: CrossSpectra, devices: int) -> np.ndarray:
    """Delays from the peak of each pair's delay profile, least absolute deviations."""
    step = float(np.min(np.diff(spectra.baseband))) / (2 * np.pi)
    size = OVERSAMPLING * (int(spectra.index.max()) + 1)
    profile = np.abs(delay_transform(spectra.value, size, spectra.index))
    lag = np.fft.fftfreq(size, d=step)[profile.argmax(axis=1)]
    design = np.zeros((len(lag), devices))
    design[np.arange(len(lag)), spectra.first] += 1
    design[np.arange(len(lag)), spectra.second] -= 1
    weight, smallest = np.ones(len(lag)), 0.01 / (step * size / OVERSAMPLING)
    delay = np.zeros(devices)
    for _ in range(ROUNDS):
        scaled = design[:, 1:] * weight[:, None]
        delay[1:] = np.linalg.lstsq(scaled, lag * weight, rcond=None)[0]
        weight = 1 / np.sqrt(np.maximum(np.abs(lag - design @ delay), smallest))
        weight /= weight.max()
    return delay


def _first_phases(spectra: CrossSpectra, delay: np.ndarray) -> np.ndarray:
    """Phases as the leading eigenvector of the pairs' phasors (Singer 2011)."""
    lag = delay[spectra.first] - delay[spectra.second]
    phasor = np.sum(spectra.value * np.exp(1j * np.outer(lag, spectra.baseband)), axis=1)
    matrix = np.zeros((len(delay), len(delay)), dtype=np.complex128)
    np.add.at(matrix, (spectra.first, spectra.second), phasor)
    _, vectors = np.linalg.eigh(matrix + np.conj(matrix.T))
    return np.angle(vectors[:, -1] * np.conj(vectors[0, -1]))


def _check_connected(layout: Layout, first: np.ndarray, second: np.ndarray) -> None:
    """Refuses pairs that leave a device without a link to the others."""
    present = set(layout.tx_device.tolist()) | set(layout.rx_device.tolist())
    reached = {min(present)}
    for _ in present:
        for a, b in zip(first.tolist(), second.tolist(), strict=True):
            if {a, b} & reached:
                reached |= {a, b}
    if reached != present:
        alone = ", ".join(str(device) for device in sorted(present - reached))
        raise RfgsError(
            f"--calibrate: no visible link connects device {alone} to device {min(present)}, so "
            "their clocks cannot be compared; within a device they cancel, leave --calibrate out"
        )
