# SPDX-License-Identifier: Apache-2.0
"""What delays alone say at a point: power back-projected without any phase."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float32

from rfgs_core.encode.back_projection import back_project
from rfgs_core.encode.protocol import FEATURES
from rfgs_core.measure.observations import Observations
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def delay_power_map(
    observations: Observations, points: Float[np.ndarray, "N 3"]
) -> Float32[np.ndarray, "pair N"]:
    """Mean over a pair's links of |Δh|² at the delay of each point.

    The matched filter with a wave number of zero: every link is read at d_t + d_r and powers
    add, since no phase ties antennas together.
    """
    change = observations.delay_change
    assert change is not None
    pair, _ = observations.pairs
    tx, rx = np.nonzero(pair >= 0)
    spacing_hz = float(observations.freq_hz[1] - observations.freq_hz[0])
    profiles = (change[tx, rx] ** 2).astype(np.complex64)[:, None]
    layout = observations.layout
    read = back_project(
        profiles,
        centre_k=np.zeros(1),
        samples_per_m=spacing_hz * change.shape[-1] / SPEED_OF_LIGHT,
        tx_xyz=layout.tx_xyz,
        rx_xyz=layout.rx_xyz,
        pair=pair,
        points=points,
    )
    return np.maximum(read[:, 0].real, 0.0).astype(np.float32)


def delay_features(
    observations: Observations, points: Float[np.ndarray, "N 3"]
) -> Float32[np.ndarray, "N 32"]:
    """φ(p) without phases: root of the mean power over pairs, the one band in every entry."""
    power = delay_power_map(observations, points).mean(axis=0)
    return np.repeat(np.sqrt(power)[:, None], FEATURES, axis=1)
