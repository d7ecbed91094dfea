# SPDX-License-Identifier: Apache-2.0
"""Applies impairments to clean channels, and takes them back."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.radio.impairments.draw import Draw
from rfgs_core.radio.impairments.oscillators import oscillator_turn
from rfgs_core.radio.impairments.receiver import (
    amplitude,
    noise,
    noise_variance,
    pair_gain_db,
    quantise,
)
from rfgs_core.radio.impairments.settings import Impairments
from rfgs_core.radio.layout import Layout
from rfgs_core.radio.presets import Radio


def impair(
    value: Complex64[np.ndarray, "sample tx rx subcarrier"],
    settings: Impairments,
    draw: Draw,
    radio: Radio,
    layout: Layout,
    samples: slice,
    random: np.random.Generator,
    static: Complex64[np.ndarray, "static tx rx subcarrier"] | None = None,
) -> tuple[
    Complex64[np.ndarray, "sample tx rx subcarrier"],
    Float64[np.ndarray, "sample device device"],
]:
    """What the receivers report instead of clean channels.

    Args:
        value: Clean channels of some samples.
        settings: How strong each impairment is.
        draw: What was drawn for all samples.
        radio: The radio.
        layout: Its antennas.
        samples: Which of the drawn samples `value` holds.
        random: Generator of the noise.
        static: Channel of the empty scene; sets the gain of a converter without gain control.

    Returns:
        Impaired channels, NaN where a packet is lost and zero on links that are not measured;
        and the gain of each pair of devices [dB].
    """
    changed = value * oscillator_turn(draw, radio, layout, samples)
    if settings.thermal_noise:
        changed = changed + noise(noise_variance(settings, radio), value.shape, random)
    changed = np.take_along_axis(changed, draw.rx_order[samples, None, :, None], axis=2)
    devices = draw.cfo_hz.size
    gain_db = np.zeros((len(value), devices, devices))
    if settings.agc:
        gain_db = pair_gain_db(settings, layout, changed)
    elif settings.adc_bits:
        fixed_db = pair_gain_db(settings, layout, changed if static is None else static)
        gain_db = np.broadcast_to(fixed_db.min(axis=0), gain_db.shape).copy()
    changed = changed * amplitude(gain_db, layout)
    if settings.adc_bits:
        changed = quantise(changed, settings.adc_bits)
    changed = np.where(layout.measured[..., None], changed, 0.0)
    changed = np.where(_lost(draw, layout, samples), np.nan + 1j * np.nan, changed)
    return changed.astype(np.complex64), gain_db


def restore(
    value: Complex64[np.ndarray, "sample tx rx subcarrier"],
    draw: Draw,
    radio: Radio,
    layout: Layout,
    samples: slice,
    gain_db: Float64[np.ndarray, "sample device device"],
) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
    """Takes back everything that is known: gain, antenna order, clocks and oscillators.

    Noise and rounding stay, and lost packets stay NaN.
    """
    level = value / amplitude(gain_db, layout)
    back = np.argsort(draw.rx_order[samples], axis=1)[:, None, :, None]
    ordered = np.take_along_axis(level, back, axis=2)
    return (ordered * np.conj(oscillator_turn(draw, radio, layout, samples))).astype(np.complex64)


def _lost(draw: Draw, layout: Layout, samples: slice) -> np.ndarray:
    received = draw.packet_received[
        samples, layout.tx_device[:, None], layout.rx_device[None, :], None
    ]
    return ~received & layout.measured[..., None]
