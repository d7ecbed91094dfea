# SPDX-License-Identifier: Apache-2.0
"""The channel between antennas at new positions, as the Gaussians of a frame let it pass.

The empty room is known along recorded links only, so two parts can be predicted elsewhere: what
the Gaussians scatter, and the straight way between the antennas (Friis, isotropic antennas) with
the shadow that the Gaussians throw on it. Reflections from walls are not in it, unless a static
set, fitted to the recorded links, stands in for them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Complex, Complex64, Complex128, Float, Float64

from rfgs_core.propagation import (
    EnvironmentPaths,
    Links,
    RadioGaussians,
    Subcarriers,
    propagate,
    shadow,
)
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.levels import decibels


@dataclass(frozen=True)
class Prediction:
    """Channels from one transmitting antenna to receiving antennas, single or in arrays."""

    tx_xyz: Float64[np.ndarray, "3"]
    """Transmitting antenna [m]."""
    element_xyz: Float64[np.ndarray, "rx element 3"]
    """Receiving elements of each position [m]; one where there is no array."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Subcarrier frequencies [Hz], equally spaced."""
    csi_scatter: Complex64[np.ndarray, "rx element subcarrier"]
    """What the Gaussians scatter."""
    csi_free: Complex64[np.ndarray, "rx element subcarrier"]
    """The straight way without a person: λ/(4πd) e^{−j2πfd/c}."""
    passed: Complex64[np.ndarray, "rx element"]
    """Share T of the straight way that passes the Gaussians, at the centre of the band."""
    csi_room: Complex64[np.ndarray, "rx element subcarrier"] | None = None
    """What the static set scatters; None without one."""

    @property
    def rx_xyz(self) -> Float64[np.ndarray, "rx 3"]:
        """Receiving positions: the centres of the arrays [m]."""
        return self.element_xyz.mean(axis=1)

    @property
    def csi_direct(self) -> Complex64[np.ndarray, "rx element subcarrier"]:
        """The straight way with the person's shadow."""
        return self.csi_free * self.passed[..., None]

    @property
    def csi(self) -> Complex64[np.ndarray, "rx element subcarrier"]:
        """All parts: the shadowed straight way, the scattering and the room's."""
        moving = self.csi_direct + self.csi_scatter
        return moving if self.csi_room is None else moving + self.csi_room


def subcarriers_of(freq_hz: Float[np.ndarray, "subcarrier"]) -> Subcarriers:
    """The whole of a uniform grid of subcarriers."""
    spacing_hz = float(freq_hz[1] - freq_hz[0]) if len(freq_hz) > 1 else 0.0
    return Subcarriers(float(freq_hz[0]), spacing_hz, len(freq_hz))


def predict_channel(
    gaussians: RadioGaussians,
    tx_xyz: Float[np.ndarray, "3"],
    element_xyz: Float[np.ndarray, "rx element 3"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    room: RadioGaussians | None = None,
) -> Prediction:
    """Channels between antennas anywhere.

    Args:
        gaussians: Gaussians as the radio sees them.
        tx_xyz: Transmitting antenna [m].
        element_xyz: Receiving elements of each position [m].
        freq_hz: Subcarrier frequencies [Hz], equally spaced.
        room: Static Gaussians as the radio sees them, in place of the room's reflections.
    """
    tx = np.asarray(tx_xyz, dtype=np.float64)
    elements = np.ascontiguousarray(element_xyz, dtype=np.float64)
    shape, flat = elements.shape[:2], elements.reshape(-1, 3)
    links = Links(torch.from_numpy(np.tile(tx, (len(flat), 1))), torch.from_numpy(flat))
    g, echoes = gaussians, []
    with torch.no_grad():
        for part in (g, *([] if room is None else [room])):
            echo = propagate(part, links, subcarriers_of(freq_hz))
            echoes.append(echo.numpy().reshape(*shape, -1).astype(np.complex64))
        passed = shadow(g.means, g.quats, g.scales, g.alpha, _straight(links, freq_hz))
    free = friis(np.linalg.norm(flat - tx, axis=1), freq_hz)
    return Prediction(
        tx_xyz=tx,
        element_xyz=elements,
        freq_hz=np.asarray(freq_hz, dtype=np.float64),
        csi_scatter=echoes[0],
        csi_free=free.reshape(*shape, -1).astype(np.complex64),
        passed=passed.numpy().reshape(shape).astype(np.complex64),
        csi_room=echoes[1] if room is not None else None,
    )


def friis(
    length_m: Float[np.ndarray, "link"], freq_hz: Float[np.ndarray, "subcarrier"]
) -> Complex128[np.ndarray, "link subcarrier"]:
    """Free space between isotropic antennas: λ/(4πd) e^{−j2πfd/c} (Friis 1946)."""
    turns = length_m[:, None] * freq_hz / SPEED_OF_LIGHT
    amplitude = SPEED_OF_LIGHT / (4 * np.pi * length_m[:, None] * freq_hz)
    return amplitude * np.exp(-2j * np.pi * turns)


def _straight(links: Links, freq_hz: np.ndarray) -> EnvironmentPaths:
    """The straight way of each link, for its shadow only."""
    nothing = torch.zeros(len(links), dtype=torch.float64)
    length = torch.linalg.vector_norm(links.tx_xyz - links.rx_xyz, dim=1)
    return EnvironmentPaths(
        link=torch.arange(len(links)),
        amplitude=torch.ones(len(links), dtype=torch.complex128),
        delay_s=length / SPEED_OF_LIGHT,
        a_xyz=links.tx_xyz,
        b_xyz=links.rx_xyz,
        extra_a_m=nothing,
        extra_b_m=nothing,
        wavelength_m=SPEED_OF_LIGHT / float(np.mean(freq_hz)),
    )


def gain_db(csi: Complex[np.ndarray, "... subcarrier"]) -> float:
    """Mean power of a channel over all its entries [dB]; −inf where it is zero."""
    power = float(np.mean(np.abs(csi).astype(np.float64) ** 2))
    return float(decibels(power, least=0.0)) if power > 0 else -np.inf
