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
from rfgs_core.propagation import Links, Subcarriers
from rfgs_core.propagation.reference import echoes
from rfgs_core.radio import Layout


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
        axes = gaussians.rotations.double() * radio.scales_rf.double()[:, None]
        ends = (torch.from_numpy(np.asarray(xyz, np.float64))[None] for xyz in (tx_xyz, rx_xyz))
        terms = echoes(
            radio.means,
            axes @ axes.mT,
            Links(*ends),
            Subcarriers(freq_hz, 0.0, 1),
            None if radio.normals is None else radio.normals.double(),
            radio.sharpness,
        )
    return float(np.sum(power * terms[:, 0, 0].abs().numpy() ** 2))


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
        block = layout.block_of(a, b)
        measured = layout.measured[block]
        have = float(np.mean(np.abs(csi[block][measured]) ** 2))
        if visible[block].any() or have == 0.0:
            continue
        wanted = expected_power(head, gaussians, power, *layout.centres_of(a, b), freq_hz)
        out[block] *= np.float32(np.sqrt(wanted / have))
    return out
