# SPDX-License-Identifier: Apache-2.0
"""Draws what every device does wrong at every sample, before any channel is touched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from rfgs_core.radio.impairments.settings import Impairments
from rfgs_core.radio.layout import Layout
from rfgs_core.seeds import sub_seed


@dataclass(frozen=True)
class Draw:
    """What was drawn for one radio; `time` runs over the samples of all frames."""

    time_s: Float64[np.ndarray, "time"]
    """True time of each sample [s]."""
    cfo_hz: Float64[np.ndarray, "device"]
    """How much too high each device's carrier is [Hz]."""
    sfo_ppm: Float64[np.ndarray, "device"]
    """How much each device's sampling clock falls behind [parts per million]."""
    sto_s: Float64[np.ndarray, "time device"]
    """How late each device's symbols start [s]."""
    phase_noise_rad: Float64[np.ndarray, "time device"]
    """Phase jitter of each device's oscillator [rad]."""
    rx_order: Int64[np.ndarray, "time rx"]
    """Which element's channel stands at each place of the receiving axis."""
    packet_received: Bool[np.ndarray, "time tx_unit rx_unit"]
    """Whether a transmitting device's packet reached a receiving device."""
    timestamp_s: Float64[np.ndarray, "time device"]
    """Time of each sample by each device's own clock [s]."""


def draw_impairments(
    settings: Impairments,
    layout: Layout,
    time_s: Float64[np.ndarray, "time"],
    seed: int,
    *purpose: str | int,
) -> Draw:
    """Draws offsets, jitter, antenna orders and losses of all devices.

    Every impairment has a generator of its own, so switching one on or off leaves the others
    as they were.

    Args:
        settings: How strong each impairment is.
        layout: The radio's antennas and their devices.
        time_s: Time of every sample [s], ascending.
        seed: Root seed.
        *purpose: What else tells this draw from others: scene and radio.
    """

    def generator(name: str) -> np.random.Generator:
        return np.random.default_rng(sub_seed(seed, *purpose, "impairments", name))

    devices = 1 + int(max(layout.tx_device.max(), layout.rx_device.max()))
    shape = (len(time_s), devices)
    sfo_ppm = settings.sfo_std_ppm * generator("sfo").standard_normal(devices)
    return Draw(
        time_s=np.asarray(time_s, np.float64),
        cfo_hz=settings.cfo_std_hz * generator("cfo").standard_normal(devices),
        sfo_ppm=sfo_ppm,
        sto_s=settings.sto_std_s * generator("sto").standard_normal(shape),
        phase_noise_rad=_phase_noise(settings, time_s, devices, generator("phase noise")),
        rx_order=_orders(settings, layout, len(time_s), generator("permutation")),
        packet_received=_received(settings, (*shape, devices), generator("loss")),
        timestamp_s=_timestamps(settings, time_s, sfo_ppm),
    )


def _phase_noise(
    settings: Impairments, time_s: np.ndarray, devices: int, random: np.random.Generator
) -> np.ndarray:
    """Ornstein–Uhlenbeck process: the phase error of a first-order locked loop.

    Its autocovariance is σ² e^{−2πB|τ|} (Mehrotra 2002, noise analysis of phase-locked loops),
    drawn exactly at the given times, however far apart.
    """
    rms_rad = np.deg2rad(settings.phase_noise_rms_deg)
    shocks = random.standard_normal((len(time_s), devices))
    steps_s = np.diff(time_s, prepend=-np.inf)
    kept = np.exp(-2 * np.pi * settings.phase_noise_bandwidth_hz * steps_s)
    phase = np.zeros((len(time_s), devices))
    state = np.zeros(devices)
    for index, keep in enumerate(kept):
        state = keep * state + np.sqrt(1.0 - keep**2) * rms_rad * shocks[index]
        phase[index] = state
    return phase


def _orders(
    settings: Impairments, layout: Layout, count: int, random: np.random.Generator
) -> np.ndarray:
    """Permutations within each device."""
    straight = np.arange(len(layout.rx_device))
    if settings.permutation == "none":
        return np.tile(straight, (count, 1))
    draws = 1 if settings.permutation == "fixed" else count
    orders = np.tile(straight, (draws, 1))
    for row in orders:
        for device in np.unique(layout.rx_device):
            elements = np.flatnonzero(layout.rx_device == device)
            row[elements] = random.permutation(elements)
    return np.tile(orders, (count // draws, 1))


def _received(
    settings: Impairments, shape: tuple[int, int, int], random: np.random.Generator
) -> np.ndarray:
    """Two-state Markov chain (Gilbert 1960), started from its stationary state.

    A loss ends with probability 1/L, so bursts have mean L; one begins with p/((1 − p) L), so
    the share of losses is p. A device always hears itself.
    """
    rate = settings.loss_rate
    # Shorter bursts than chance gives would need every loss to be followed by a success.
    burst = max(settings.loss_burst, 1.0 / (1.0 - rate))
    begin = rate / ((1.0 - rate) * burst)
    dice = random.random(shape)
    lost = np.zeros(shape, bool)
    state = dice[0] < rate if shape[0] else np.zeros(shape[1:], bool)
    for index in range(shape[0]):
        if index:
            state = np.where(state, dice[index] >= 1.0 / burst, dice[index] < begin)
        lost[index] = state
    lost[:, np.arange(shape[1]), np.arange(shape[1])] = False
    return ~lost


def _timestamps(settings: Impairments, time_s: np.ndarray, sfo_ppm: np.ndarray) -> np.ndarray:
    """A clock that falls behind by s ppm shows t/(1 + s·10⁻⁶), in whole steps."""
    own = np.asarray(time_s)[:, None] / (1.0 + 1e-6 * sfo_ppm)
    step_s = settings.timestamp_step_s
    return np.floor(own / step_s + 1e-9) * step_s if step_s else own
