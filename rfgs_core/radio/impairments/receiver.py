# SPDX-License-Identifier: Apache-2.0
"""What a receiver adds: thermal noise, gain and the steps of its converter."""

from __future__ import annotations

from typing import Any

import numpy as np

from rfgs_core.radio.constants import BOLTZMANN
from rfgs_core.radio.impairments.settings import Impairments
from rfgs_core.radio.layout import Layout
from rfgs_core.radio.levels import amplitude_decibels, amplitude_of, power_of
from rfgs_core.radio.presets import Radio

#: Temperature that noise figures refer to (IEEE standard temperature) [K].
REFERENCE_TEMPERATURE_K = 290.0


def noise_variance(settings: Impairments, radio: Radio) -> float:
    """Power E|n|² of the noise on one channel coefficient, kTBF/P, a ratio like the channel.

    Transmit power P and bandwidth B are shared by all subcarriers alike, so P/N over Δf = B/N is P
    over B. One symbol lasts 1/Δf; averaging several divides the power.
    """
    figure_db = (
        radio.noise_figure_db if settings.noise_figure_db is None else (settings.noise_figure_db)
    )
    power_dbm = radio.power_dbm if settings.power_dbm is None else settings.power_dbm
    power_w = power_of(power_dbm) * 1e-3
    noise_w = BOLTZMANN * REFERENCE_TEMPERATURE_K * radio.bandwidth_hz * power_of(figure_db)
    return noise_w / power_w / settings.training_symbols


def noise(variance: float, shape: tuple[int, ...], random: np.random.Generator) -> np.ndarray:
    """Circular complex normal noise of power `variance`."""
    parts = random.standard_normal((*shape, 2)) * np.sqrt(variance / 2)
    return parts[..., 0] + 1j * parts[..., 1]


def pair_gain_db(settings: Impairments, layout: Layout, value: np.ndarray) -> np.ndarray:
    """Gain that brings each device pair's strongest component to full scale less headroom [dB].

    Args:
        settings: Step and headroom.
        layout: Devices of the elements.
        value: Channels (sample, tx, rx, subcarrier) before the gain.

    Returns:
        Whole steps, rounded down, (sample, transmitting device, receiving device); zero for
        pairs without a measured link.
    """
    devices = 1 + int(max(layout.tx_device.max(), layout.rx_device.max()))
    strongest = np.maximum(np.abs(value.real), np.abs(value.imag)).max(axis=-1)
    peak = np.zeros((len(value), devices, devices))
    index: Any = (slice(None), layout.tx_device[:, None], layout.rx_device[None, :])
    np.maximum.at(peak, index, np.where(layout.measured, strongest, 0.0))
    wanted_db = -settings.headroom_db - amplitude_decibels(
        np.where(peak > 0.0, peak, 1.0), least=0.0
    )
    steps = np.floor(wanted_db / settings.agc_step_db)
    return np.where(peak > 0.0, steps * settings.agc_step_db, 0.0)


def amplitude(gain_db: np.ndarray, layout: Layout) -> np.ndarray:
    """Field gain of every link (sample, tx, rx, 1) from gains of device pairs [dB]."""
    gain = amplitude_of(gain_db)
    return gain[:, layout.tx_device[:, None], layout.rx_device[None, :], None]


def quantise(value: np.ndarray, bits: int) -> np.ndarray:
    """Rounds I and Q to the nearest of 2^bits steps Δ = 2^(1 − bits) over ±1; clips beyond."""
    step, half = 2.0 ** (1 - bits), 2 ** (bits - 1)

    def rounded(part: np.ndarray) -> np.ndarray:
        return np.clip(np.rint(part / step), -half, half - 1) * step

    return rounded(value.real) + 1j * rounded(value.imag)
