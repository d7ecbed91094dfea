# SPDX-License-Identifier: Apache-2.0
"""Paths of the empty scene that a body can shadow, taken from the empty-room capture.

Only the direct path of each link is used: its geometry is known exactly. One complex factor
per device pair, fitted to the empty-room channel, holds antenna gain and phase reference.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Bool, Complex64, Complex128, Int64

from rfgs_core.measure.observations import Observations
from rfgs_core.propagation import EnvironmentPaths
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def direct_gain(
    observations: Observations, pair: Int64[np.ndarray, "tx rx"], count: int
) -> Complex128[np.ndarray, "pair"]:
    """Complex factor on Friis' direct path per device pair, by least squares."""
    tx, rx = np.nonzero(pair >= 0)
    wave = direct_channel(observations)[tx, rx][:, observations.subcarriers].astype(np.complex128)
    seen = observations.static[tx, rx][:, observations.subcarriers]
    index = pair[tx, rx]
    match = np.sum(np.conj(wave) * seen, axis=1)
    power = np.sum(np.abs(wave) ** 2, axis=1)
    real = np.bincount(index, match.real, count) + 1j * np.bincount(index, match.imag, count)
    return real / np.maximum(np.bincount(index, power, count), 1e-30)


def direct_channel(observations: Observations) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Friis' direct path of every link, λ/(4πd) e^{−j2πfd/c}."""
    offset = observations.layout.tx_xyz[:, None] - observations.layout.rx_xyz
    length_m = np.maximum(np.linalg.norm(offset, axis=2), 1e-3)[..., None]
    wavelength_m = SPEED_OF_LIGHT / observations.freq_hz
    turn = np.exp(-2j * np.pi * length_m / wavelength_m)
    return (wavelength_m / (4 * np.pi * length_m) * turn).astype(np.complex64)


def direct_background(
    observations: Observations,
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """Direct paths of all measured links, those within a device too, with the pairs' gains.

    A device pair that training cannot see gets the gain of the reversed pair, else that of free
    space.
    """
    pair, names = observations.pairs
    gains = dict(zip(names, direct_gain(observations, pair, len(names)), strict=True))
    layout, direct = observations.layout, direct_channel(observations)
    for a, b in layout.device_pairs:
        direct[layout.block_of(a, b)] *= np.complex64(gains.get((a, b), gains.get((b, a), 1.0)))
    return direct * layout.measured[..., None]


def direct_paths(observations: Observations, links: Bool[np.ndarray, "tx rx"]) -> EnvironmentPaths:
    """Direct paths of the links between different devices.

    Args:
        observations: Gives geometry and the visible part of the empty-room channel.
        links: Which links; those within a device are left out, since nobody stands between
            the antennas of one housing.

    Returns:
        Paths whose `link` counts the marked links in row-major order. Device pairs that
        training cannot see get the gain of the reversed pair, else the mean over pairs.
    """
    pair, names = observations.pairs
    gains = dict(zip(names, direct_gain(observations, pair, len(names)), strict=True))
    cross = [gain for (a, b), gain in gains.items() if a != b]
    tx, rx = np.nonzero(links)
    device_t, device_r = observations.layout.tx_device[tx], observations.layout.rx_device[rx]
    between = device_t != device_r if cross else np.zeros(len(tx), dtype=bool)
    tx, rx, link = tx[between], rx[between], np.nonzero(between)[0]
    gain = np.array(
        [
            gains.get((a, b), gains.get((b, a), np.mean(cross)))
            for a, b in zip(device_t[between], device_r[between], strict=True)
        ],
        dtype=np.complex128,
    )
    a_xyz, b_xyz = observations.layout.tx_xyz[tx], observations.layout.rx_xyz[rx]
    length = np.linalg.norm(a_xyz - b_xyz, axis=1)
    wavelength_m = SPEED_OF_LIGHT / observations.centre_hz
    nothing = torch.zeros(len(link), dtype=torch.float64)
    return EnvironmentPaths(
        link=torch.from_numpy(link),
        amplitude=torch.from_numpy(gain * wavelength_m / (4 * np.pi * length)),
        delay_s=torch.from_numpy(length / SPEED_OF_LIGHT),
        a_xyz=torch.from_numpy(a_xyz),
        b_xyz=torch.from_numpy(b_xyz),
        extra_a_m=nothing,
        extra_b_m=nothing,
        wavelength_m=wavelength_m,
    )
