# SPDX-License-Identifier: Apache-2.0
"""Delay profiles, and power over the direction it comes from."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Complex, Float, Float64

from rfgs_core.predict.echoes import Echoes
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_profile, hann

#: Delay samples per subcarrier: the peak of a path is read within 0.1 dB.
OVERSAMPLING = 8
#: Width of a cell of the spatial spectrum [°].
CELL_DEG = 2.0
#: Subcarriers, evenly spread, that the beams of an array are formed on.
BEAM_SUBCARRIERS = 16


def profile_over_delay(
    csi: Complex[np.ndarray, "*link subcarrier"], freq_hz: Float[np.ndarray, "subcarrier"]
) -> tuple[Float64[np.ndarray, "*link delay"], Float64[np.ndarray, "delay"]]:
    """Magnitude over absolute delay, Hann-windowed: a path of amplitude a peaks at |a|.

    Args:
        csi: Channels with absolute delays.
        freq_hz: Subcarrier frequencies [Hz], equally spaced, at least two.

    Returns:
        Magnitudes, and delays from 0 to 1/Δf [s], after which they repeat.
    """
    window = hann(len(freq_hz))
    response = delay_profile(csi, window / window.sum(), OVERSAMPLING, peak=True)
    size = response.shape[-1]
    return np.abs(response), np.arange(size) / (size * float(freq_hz[1] - freq_hz[0]))


def sky_cells() -> tuple[Float64[np.ndarray, "elevation"], Float64[np.ndarray, "azimuth"]]:
    """Centres of the cells of the spatial spectrum: elevation and azimuth [°]."""
    half = 0.5 * CELL_DEG
    return np.arange(-90 + half, 90, CELL_DEG), np.arange(-180 + half, 180, CELL_DEG)


def arrival_power(echoes: Echoes) -> Float64[np.ndarray, "rx elevation azimuth"]:
    """Power by the direction it arrives from, summed over the Gaussians without phases.

    What an array of unlimited size would see. The sum over a receiver's cells is the sum of
    the powers of all Gaussians' echoes.
    """
    elevation, azimuth = sky_cells()
    spectrum = np.zeros((echoes.power.shape[0], len(elevation), len(azimuth)))
    row = ((echoes.elevation_deg + 90) // CELL_DEG).astype(int).clip(0, len(elevation) - 1)
    column = ((echoes.azimuth_deg + 180) // CELL_DEG).astype(int) % len(azimuth)
    receiver = np.broadcast_to(np.arange(len(spectrum))[:, None], row.shape)
    np.add.at(spectrum, (receiver, row, column), echoes.power)
    return spectrum


def beam_power(
    csi: Complex[np.ndarray, "element subcarrier"],
    element_xyz: Float[np.ndarray, "element 3"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    boresight_rad: float,
) -> Float64[np.ndarray, "elevation azimuth"]:
    """What an array's beams receive (Bartlett), over directions on its front; NaN behind it.

    A plane wave of amplitude a shows |a|² in its direction. Cells as in `sky_cells`.
    """
    elevation, azimuth = np.deg2rad(np.meshgrid(*sky_cells(), indexing="ij"))
    towards = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        axis=-1,
    )
    front = towards @ [np.cos(boresight_rad), np.sin(boresight_rad), 0.0] > 0
    ahead_m = towards[front] @ (element_xyz - element_xyz.mean(axis=0)).T
    chosen = np.unique(np.linspace(0, len(freq_hz) - 1, BEAM_SUBCARRIERS).astype(int))
    power = np.zeros(len(ahead_m))
    for subcarrier in chosen:
        phase = 2 * np.pi * freq_hz[subcarrier] / SPEED_OF_LIGHT * ahead_m
        power += np.abs(np.exp(-1j * phase) @ csi[:, subcarrier] / len(csi)) ** 2
    spectrum = np.full(front.shape, np.nan)
    spectrum[front] = power / len(chosen)
    return spectrum


def strongest(arrays: Mapping[str, np.ndarray], index: int) -> tuple[float, float, float]:
    """Delay [s], azimuth and elevation [°] of the strongest scattering at a receiver.

    Args:
        arrays: A prediction as `rfgs_core.predict.arrays` names it.
        index: Which receiver.
    """
    power = arrays.get("beam_power", arrays["arrival_power"])[index]
    row, column = np.unravel_index(int(np.nanargmax(power)), power.shape)
    delay_s = arrays["delay_s"][int(arrays["profile_scatter"][index].argmax())]
    azimuth, elevation = arrays["azimuth_deg"][column], arrays["elevation_deg"][row]
    return float(delay_s), float(azimuth), float(elevation)
