# SPDX-License-Identifier: Apache-2.0
"""What each Gaussian reflects: towards receivers, and by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float64

from rfgs_core.propagation import Links, RadioGaussians, Subcarriers
from rfgs_core.propagation.covariance import covariances
from rfgs_core.propagation.reference import echoes, gamma_at_subcarriers
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Subcarriers, spread over the band, that powers are averaged over.
POWER_SUBCARRIERS = 5


@dataclass(frozen=True)
class Echoes:
    """The echo of every Gaussian at every receiving position."""

    power: Float64[np.ndarray, "rx M"]
    """Received over transmitted power, mean over the band."""
    delay_s: Float64[np.ndarray, "rx M"]
    """Delay from antenna to Gaussian to antenna [s]."""
    azimuth_deg: Float64[np.ndarray, "rx M"]
    """Direction the echo arrives from, from +x towards +y [°]."""
    elevation_deg: Float64[np.ndarray, "rx M"]
    """Direction the echo arrives from, above the horizon [°]."""


@dataclass(frozen=True)
class Reflectors:
    """What each Gaussian reflects, whoever looks."""

    rcs_m2: Float64[np.ndarray, "M"]
    """|γ|², its radar cross-section seen face on if it were a point, mean over the band [m²]."""
    phase_rad: Float64[np.ndarray, "M"]
    """Phase of γ at the centre of the band [rad]."""
    slope: Float64[np.ndarray, "M"]
    """d ln|γ|² / d ln f over the band; NaN where γ is one value for the whole band."""


def band_subcarriers(
    freq_hz: Float[np.ndarray, "subcarrier"],
) -> Subcarriers:
    """A few subcarriers spread over a band, its edges among them."""
    low, high = float(freq_hz[0]), float(freq_hz[-1])
    if high == low:
        return Subcarriers(0.5 * (low + high), 0.0, 1)
    return Subcarriers(low, (high - low) / (POWER_SUBCARRIERS - 1), POWER_SUBCARRIERS)


def echoes_at(
    gaussians: RadioGaussians,
    tx_xyz: Float[np.ndarray, "3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    freq_hz: Float[np.ndarray, "subcarrier"],
) -> Echoes:
    """Echoes at receiving positions, of a transmitter at `tx_xyz` [m]."""
    g, subcarriers = gaussians, band_subcarriers(freq_hz)
    tx = torch.from_numpy(np.tile(np.asarray(tx_xyz, dtype=np.float64), (len(rx_xyz), 1)))
    rx = torch.from_numpy(np.ascontiguousarray(rx_xyz, dtype=np.float64))
    with torch.no_grad():
        shape = covariances(g.quats, g.scales_rf)
        terms = echoes(g.means, shape, Links(tx, rx), subcarriers, g.normals, g.sharpness)
        terms = terms * gamma_at_subcarriers(g.gamma, subcarriers)[:, None]
        power = (terms.abs().double() ** 2).mean(dim=2).T.numpy()
    means = g.means.detach().numpy().astype(np.float64)
    leg = means - np.asarray(rx_xyz)[:, None]
    length_m = np.linalg.norm(leg, axis=2)
    return Echoes(
        power=power,
        delay_s=(length_m + np.linalg.norm(means - tx_xyz, axis=1)) / SPEED_OF_LIGHT,
        azimuth_deg=np.rad2deg(np.arctan2(leg[..., 1], leg[..., 0])),
        elevation_deg=np.rad2deg(np.arcsin(np.clip(leg[..., 2] / length_m, -1, 1))),
    )


def reflectors(gaussians: RadioGaussians, freq_hz: Float[np.ndarray, "subcarrier"]) -> Reflectors:
    """Reflected power, phase and frequency slope of every Gaussian."""
    gamma = gaussians.gamma.detach().to(torch.complex128)
    middle = gamma_at_subcarriers(gamma, Subcarriers(float(freq_hz[0]), 1.0, 3, ((1, 1),)))[:, 0]
    power = (gamma.abs() ** 2).numpy()
    slope = np.full(len(power), np.nan)
    if power.shape[1] > 1:
        log_freq = np.log(np.linspace(freq_hz[0], freq_hz[-1], power.shape[1]))
        log_freq -= log_freq.mean()
        slope = np.log(np.maximum(power, 1e-30)) @ log_freq / np.sum(log_freq**2)
    return Reflectors(power.mean(axis=1), np.angle(middle.numpy()), slope)
