# SPDX-License-Identifier: Apache-2.0
"""What imperfect oscillators and clocks do: a phase per link, subcarrier and sample."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex128, Float64

from rfgs_core.radio.impairments.draw import Draw
from rfgs_core.radio.layout import Layout
from rfgs_core.radio.presets import Radio


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
