# SPDX-License-Identifier: Apache-2.0
"""Sample points of the paper's losses: a voxel grid and points along the links (section 3.2)."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float64

from rfgs_core.encode.matched_filter import matched_filter_features
from rfgs_core.gaussians import FEATURE_DIM
from rfgs_core.train.losses import SamplePoints
from rfgs_core.train.observations import Observations

#: Points per line between a transmitting and a receiving device.
POINTS_PER_LINE = 64


def voxel_points(bounds_m: Float64[np.ndarray, "2 3"], side: int) -> Float64[np.ndarray, "N 3"]:
    """Centres of side³ voxels that fill the bounds."""
    axes = [
        bounds_m[0, k] + (np.arange(side) + 0.5) / side * (bounds_m[1, k] - bounds_m[0, k])
        for k in range(3)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def line_points(observations: Observations, rng: np.random.Generator) -> Float64[np.ndarray, "N 3"]:
    """One point drawn in each of equal stretches of the lines between devices."""
    _, names = observations.pairs
    lines = []
    for a, b in names:
        if a == b:
            continue
        start = observations.layout.tx_xyz[observations.layout.tx_device == a].mean(axis=0)
        end = observations.layout.rx_xyz[observations.layout.rx_device == b].mean(axis=0)
        share = (np.arange(POINTS_PER_LINE) + rng.random(POINTS_PER_LINE)) / POINTS_PER_LINE
        lines.append(start + share[:, None] * (end - start))
    return np.concatenate(lines) if lines else np.zeros((0, 3))


def encode(observations: Observations, points: Float64[np.ndarray, "N 3"]) -> SamplePoints:
    """Matched-filter features φ at `points`, RMS of ‖φ‖ one."""
    pair, _ = observations.pairs
    features = matched_filter_features(
        observations.delta,
        observations.layout.tx_xyz,
        observations.layout.rx_xyz,
        pair,
        observations.freq_hz,
        points,
        FEATURE_DIM,
    )
    return SamplePoints(torch.from_numpy(points).float(), torch.from_numpy(features))


def sample_points(observations: Observations, side: int, rng: np.random.Generator) -> SamplePoints:
    """Grid and line points with their features, as the paper's losses take them."""
    points = np.concatenate(
        [voxel_points(observations.bounds_m, side), line_points(observations, rng)]
    )
    return encode(observations, points)
