# SPDX-License-Identifier: Apache-2.0
"""Sample points of the paper's losses (section 3.2).

A voxel grid, points along the links, and finer points where the energy is.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float, Float64

from rfgs_core.encode import Encoder, MatchedFilter, unit_rms
from rfgs_core.errors import RfgsError
from rfgs_core.fit.losses import SamplePoints
from rfgs_core.measure.delay_maps import delay_features
from rfgs_core.measure.observations import Observations

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
        start, end = observations.layout.centres_of(a, b)
        share = (np.arange(POINTS_PER_LINE) + rng.random(POINTS_PER_LINE)) / POINTS_PER_LINE
        lines.append(start + share[:, None] * (end - start))
    return np.concatenate(lines) if lines else np.zeros((0, 3))


def finer_points(
    centres: Float64[np.ndarray, "N 3"],
    energy: Float[np.ndarray, "N"],
    count: int,
    cell_m: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, "M 3"]:
    """Centres of the eight parts of the `count` cells that hold most energy, at most all.

    Args:
        centres: Centres of cells [m].
        energy: ‖φ‖² at the centres.
        count: How many cells to split; those without energy stay whole.
        cell_m: Edges of a cell [m].
    """
    strongest = np.argsort(-energy, kind="stable")[:count]
    strongest = strongest[energy[strongest] > 0.0]
    corners = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return (centres[strongest, None] + corners * cell_m).reshape(-1, 3)


def _features(
    observations: Observations, points: Float64[np.ndarray, "N 3"], encoder: Encoder
) -> Float[np.ndarray, "N 32"]:
    """φ before it is scaled; powers per delay have an encoder of their own.

    Raises:
        RfgsError: The encoder needs phases, and there are none.
    """
    if observations.kind != "delay_power":
        return encoder(observations, points)
    if not isinstance(encoder, MatchedFilter):
        raise RfgsError(
            "a learned encoder reads the channel over subcarriers, and `--observe delay_power` "
            "hides it; leave --encoder out, or choose --observe complex or power"
        )
    return delay_features(observations, points)


def encode(
    observations: Observations, points: Float64[np.ndarray, "N 3"], encoder: Encoder
) -> SamplePoints:
    """Features φ at `points`, RMS of ‖φ‖ one."""
    features = unit_rms(_features(observations, points, encoder))
    return SamplePoints(torch.from_numpy(points).float(), torch.from_numpy(features))


def sample_points(
    observations: Observations,
    side: int,
    rng: np.random.Generator,
    encoder: Encoder,
    levels: int = 0,
) -> SamplePoints:
    """Grid and line points with their features, and finer points where the energy is.

    Each level splits cells of the level before into eight: of the grid's side³ cells the 64th
    part with most energy, then the eighth part of the new ones. A level thus adds an eighth of
    the grid's points and halves their spacing.

    Args:
        observations: Channel of the frame.
        side: Voxels per side of the grid.
        rng: Draws the line points; nothing else is random.
        encoder: φ.
        levels: How often to refine; 0 is the paper's own sampling.
    """
    grid = voxel_points(observations.bounds_m, side)
    points = [np.concatenate([grid, line_points(observations, rng)])]
    features = [_features(observations, points[0], encoder)]
    centres, energy = grid, np.sum(features[0][: len(grid)] ** 2, axis=1)
    cell_m = (observations.bounds_m[1] - observations.bounds_m[0]) / side
    for _ in range(levels):
        centres = finer_points(centres, energy, max(1, len(grid) // 64), cell_m)
        cell_m = 0.5 * cell_m
        points.append(centres)
        features.append(_features(observations, centres, encoder))
        energy = np.sum(features[-1] ** 2, axis=1)
    return SamplePoints(
        torch.from_numpy(np.concatenate(points)).float(),
        torch.from_numpy(unit_rms(np.concatenate(features))),
    )
