# SPDX-License-Identifier: Apache-2.0
"""Applies impairments to clean channels, and takes them back."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex64, Complex128, Float64

from rfgs_core.radio.impairments.draw import Draw
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


def oscillator_phase_rad(
    draw: Draw, radio: Radio, samples: slice
) -> Float64[np.ndarray, "sample device device subcarrier"]:
    """Phase that a transmitting (first) and a receiving device add to a channel [rad].

    With the transmitter's quantities minus the receiver's: 2π Δf t for the carrier, the jitter,
    and −2π (f − f_c) Δτ(t) for timing, where a device is late by τ(t) = sto + sfo·10⁻⁶·t.
    A device that hears itself shares its oscillator with itself: nothing is left.
    """
    time_s = draw.time_s[samples, None]
    carrier = 2 * np.pi * draw.cfo_hz * time_s + draw.phase_noise_rad[samples]
    late_s = draw.sto_s[samples] + 1e-6 * draw.sfo_ppm * time_s
    baseband = 2 * np.pi * (radio.freq_hz - radio.centre_hz)
    between = carrier[:, :, None] - carrier[:, None, :]
    difference_s = late_s[:, :, None] - late_s[:, None, :]
    return between[..., None] - difference_s[..., None] * baseband


def oscillator_turn(
    draw: Draw, radio: Radio, layout: Layout, samples: slice
) -> Complex128[np.ndarray, "sample tx rx subcarrier"]:
    """Factor of modulus one by which oscillators and clocks turn every link."""
    turn = np.exp(1j * oscillator_phase_rad(draw, radio, samples))
    return turn[:, layout.tx_device[:, None], layout.rx_device[None, :]]
