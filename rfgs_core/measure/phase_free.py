# SPDX-License-Identifier: Apache-2.0
"""What radios tell that report no phase: power per subcarrier, or power per delay.

**Power per subcarrier.** With the empty room H₀ and its change Δ,

    |H₀ + Δ|² − |H₀|² = 2 Re(H₀* Δ) + |Δ|²,

so the empty room's channel is the reference wave of a hologram (D. Gabor, Nature 161, 1948).
Its phase is not measured either, but that of the direct path follows from the antennas'
places: u = exp(−jkd). The hologram u (|H₀ + Δ|² − |H₀|²) / level is Δ itself, its twin u²Δ*,
whose delay 2d − τ is shorter than the direct path and thus belongs to no place, and |Δ|²,
which is small beside both. This holds as far as the direct path is the strongest of the empty
room: where it is blocked, the reference has another phase and the link blurs the picture.

**Power per delay.** Nothing but |h(τ)| of each link, h being the profile of the windowed band.
What the frame changes is ||h| − |h₀||, at most |Δh|: exact where the empty room is silent, and
half the power on average where it is loud. Phases between antennas are gone, so only delays
tell places.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex64, Float, Float32, Float64

from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import band_window, delay_profile

#: Samples of a delay profile per resolution cell 1/B of the whole band.
DELAY_SAMPLES = 4
#: A link's reference wave counts as at least this share of the strongest link's amplitude.
LEAST_REFERENCE = 1e-3


def direct_wave(
    layout: Layout, freq_hz: Float64[np.ndarray, "subcarrier"]
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Phasor u of each link's direct path, computed from where the antennas stand."""
    length_m = np.linalg.norm(layout.tx_xyz[:, None] - layout.rx_xyz[None], axis=2)
    turns = length_m[..., None] * freq_hz / SPEED_OF_LIGHT
    return np.exp(-2j * np.pi * (turns - np.round(turns))).astype(np.complex64)


def reference_level(
    empty_amplitude: Float[np.ndarray, "*link subcarrier"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
) -> Float32[np.ndarray, "*link"]:
    """RMS amplitude of each link's empty room over the visible subcarriers, never quite zero."""
    level = np.sqrt(np.mean(empty_amplitude[..., subcarriers].astype(np.float64) ** 2, axis=-1))
    floor = LEAST_REFERENCE * level.max() if level.size else 0.0
    return np.maximum(level, max(floor, 1e-30)).astype(np.float32)


def hologram(
    amplitude: Float[np.ndarray, "tx rx subcarrier"],
    empty_amplitude: Float[np.ndarray, "tx rx subcarrier"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
    wave: Complex64[np.ndarray, "tx rx subcarrier"],
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Change of power over the level of the reference, on the direct path's phase.

    Args:
        amplitude: |csi| of the frame.
        empty_amplitude: |csi| of the empty room.
        subcarriers: Visible subcarriers.
        wave: `direct_wave`.
    """
    level = reference_level(empty_amplitude, subcarriers)[..., None]
    change = (amplitude.astype(np.float64) ** 2 - empty_amplitude.astype(np.float64) ** 2) / level
    return (wave * change).astype(np.complex64)


def delay_amplitude(
    csi: Complex64[np.ndarray, "*link subcarrier"], subcarriers: Bool[np.ndarray, "subcarrier"]
) -> Float32[np.ndarray, "*link delay"]:
    """|h(τ)| of the windowed visible band; a path of amplitude a peaks at a.

    The samples cover one period 1/Δf of delay, `DELAY_SAMPLES` per resolution cell.
    """
    visible = np.where(subcarriers, csi, 0)
    profile = delay_profile(visible, band_window(subcarriers), DELAY_SAMPLES, peak=True)
    return np.abs(profile).astype(np.float32)


def direct_amplitude(
    profile: Float[np.ndarray, "tx rx delay"],
    layout: Layout,
    spacing_hz: float,
) -> Float32[np.ndarray, "tx rx"]:
    """|h(τ)| of each link at the delay of its direct path, to the nearest sample."""
    length_m = np.linalg.norm(layout.tx_xyz[:, None] - layout.rx_xyz[None], axis=2)
    size = profile.shape[-1]
    index = np.round(length_m / SPEED_OF_LIGHT * spacing_hz * size).astype(np.int64) % size
    return np.take_along_axis(profile, index[..., None], axis=-1)[..., 0].astype(np.float32)
