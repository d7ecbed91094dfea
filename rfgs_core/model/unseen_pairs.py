# SPDX-License-Identifier: Apache-2.0
"""The level of device pairs of which nothing was measured.

Phases between devices that never heard each other are unknown, and reflectivities fitted to
other pairs add up to less than their powers there, as to chance. What can be said of such a pair is
its mean power: reflected powers without phases.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Bool, Complex64, Float

from rfgs_core.gaussians import Gaussians
from rfgs_core.model.head import RadioHead
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def expected_power(
    head: RadioHead,
    gaussians: Gaussians,
    power: Float[np.ndarray, "M"],
    tx_xyz: Float[np.ndarray, "3"],
    rx_xyz: Float[np.ndarray, "3"],
    freq_hz: float,
) -> float:
    """Mean |ΔH|² of a link if all Gaussians scatter with independent phases.

    Σ p_i (v_i λ/((4π)^{3/2} d_t d_r))² exp(−k² qᵀΣ_rf q), the terms of `docs/method.md` squared.

    Args:
        head: Decodes ρ from the features.
        gaussians: The Gaussians.
        power: Reflected power of each [m²].
        tx_xyz: Transmitting antenna [m].
        rx_xyz: Receiving antenna [m].
        freq_hz: Frequency [Hz].
    """
    with torch.no_grad():
        radio = head.radio_gaussians(gaussians)
        axes = gaussians.rotations.numpy().astype(np.float64)
    means, normals = radio.means.numpy(), axes[:, :, 2]
    wavelength_m = SPEED_OF_LIGHT / freq_hz
    amplitude = np.full(len(means), wavelength_m / (4 * np.pi) ** 1.5)
    q = np.zeros((len(means), 3))
    for antenna in (tx_xyz, rx_xyz):
        towards = antenna - means
        distance_m = np.linalg.norm(towards, axis=1)
        towards = towards / distance_m[:, None]
        amplitude /= distance_m * (1 + np.exp(-radio.sharpness * np.sum(normals * towards, axis=1)))
        q += towards
    along = np.einsum("mij,mi->mj", axes, q) * radio.scales_rf.numpy()
    blur = np.exp(-((2 * np.pi / wavelength_m) ** 2) * np.sum(along**2, axis=1))
    return float(np.sum(power * amplitude**2 * blur))


def levelled(
    csi: Complex64[np.ndarray, "tx rx subcarrier"],
    visible: Bool[np.ndarray, "tx rx"],
    layout: Layout,
    freq_hz: float,
    head: RadioHead,
    gaussians: Gaussians,
    power: Float[np.ndarray, "M"],
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """The predicted change with the mean power of unseen device pairs set to the expected one.

    Args:
        csi: Predicted csi − csi_static.
        visible: Links that training saw.
        layout: Antenna elements.
        freq_hz: Centre of the band [Hz].
        head: Decodes ρ from the features.
        gaussians: Moving Gaussians.
        power: Reflected power of each [m²].
    """
    out = csi.copy()
    for a, b in layout.device_pairs:
        tx, rx = layout.tx_device == a, layout.rx_device == b
        block = np.ix_(tx, rx)
        measured = layout.measured[block]
        have = float(np.mean(np.abs(csi[block][measured]) ** 2))
        if visible[block].any() or have == 0.0:
            continue
        centres = layout.tx_xyz[tx].mean(axis=0), layout.rx_xyz[rx].mean(axis=0)
        wanted = expected_power(head, gaussians, power, *centres, freq_hz)
        out[block] *= np.float32(np.sqrt(wanted / have))
    return out
