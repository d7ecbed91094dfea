# SPDX-License-Identifier: Apache-2.0
"""The first Gaussians of a frame: drawn from a body-sized prior times the matched filter."""

from __future__ import annotations

import math

import numpy as np
import torch
from jaxtyping import Float, Float64, Int64
from torch import Tensor

from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.train.localise import PairMaps

#: Standard deviation of the prior around a body's vertical axis [m].
PRIOR_RADIUS_M = 0.20
#: Height above which the prior falls off, and how fast [m].
PRIOR_HEIGHT_M, PRIOR_HEIGHT_FALL_M = 1.6, 0.08
#: Exponent of the matched filter against the prior, chosen on a room that is not in the demo.
EVIDENCE_EXPONENT = 0.25
#: Standard deviation of a new Gaussian along the surface and across it [m].
START_SCALES_M = (0.04, 0.04, 0.025)
#: Layers that the new Gaussians put on a body's silhouette. The shadow model multiplies
#: transmissions of complex blobs, which is only sound while few layers overlap.
START_COVERAGE = 1.5
#: Silhouette of a standing body [m²].
SILHOUETTE_M2 = 0.75


def log_density(
    maps: PairMaps, axes_xy: Float[np.ndarray, "body 2"], points: Float[np.ndarray, "N 3"]
) -> Float64[np.ndarray, "N"]:
    """Unnormalised log density of moving surface at `points`, given the bodies' axes."""
    radius = np.linalg.norm(points[:, None, :2] - axes_xy[None], axis=2).min(axis=1)
    above = np.clip(points[:, 2] - PRIOR_HEIGHT_M, 0.0, None)
    prior = -0.5 * (radius / PRIOR_RADIUS_M) ** 2 - 0.5 * (above / PRIOR_HEIGHT_FALL_M) ** 2
    evidence = np.log(maps.at(points) + 1e-3).mean(axis=0)
    return prior + EVIDENCE_EXPONENT * evidence


def nearest_axis(
    points: Float[np.ndarray, "N 3"], axes_xy: Float[np.ndarray, "body 2"]
) -> Int64[np.ndarray, "N"]:
    """Which body axis is nearest to each point, seen from above."""
    return np.linalg.norm(points[:, None, :2] - axes_xy[None], axis=2).argmin(axis=1)


def outward_normals(
    points: Float[np.ndarray, "N 3"], axes_xy: Float[np.ndarray, "body 2"]
) -> Float64[np.ndarray, "N 3"]:
    """Horizontal directions away from the nearest body axis."""
    flat = points[:, :2] - axes_xy[nearest_axis(points, axes_xy)]
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)
    return np.concatenate([flat, np.zeros((len(points), 1))], axis=1)


def draw_points(
    maps: PairMaps,
    axes_xy: Float[np.ndarray, "body 2"],
    bounds_m: Float64[np.ndarray, "2 3"],
    count: int,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "count 3"]:
    """Draws positions from the density of `log_density`, on a jittered 4 cm grid."""
    step, reach = 0.04, 4 * PRIOR_RADIUS_M
    low = np.maximum([*(axes_xy.min(axis=0) - reach), bounds_m[0, 2]], bounds_m[0])
    high = np.minimum([*(axes_xy.max(axis=0) + reach), bounds_m[0, 2] + 2.1], bounds_m[1])
    axes = [np.arange(low[k] + step / 2, high[k], step) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    density = log_density(maps, axes_xy, grid)
    share = np.exp(density - density.max())
    chosen = rng.choice(len(grid), size=count, p=share / share.sum())
    points = grid[chosen] + rng.uniform(-step / 2, step / 2, (count, 3))
    # The last cell along an axis may stick out of the scene.
    return np.clip(points, low, high)


def quats_from_normals(normals: Float[np.ndarray, "N 3"]) -> Float[Tensor, "N 4"]:
    """Rotations that turn local +Z into the given unit normals, w first."""
    axis = np.cross([0.0, 0.0, 1.0], normals)
    quats = np.concatenate([1.0 + normals[:, 2:], axis], axis=1)
    upside_down = quats[:, 0] < 1e-9
    quats[upside_down] = [0.0, 1.0, 0.0, 0.0]
    return torch.from_numpy(quats / np.linalg.norm(quats, axis=1, keepdims=True)).float()


def gaussians_at(points: Float[np.ndarray, "N 3"], normals: Float[np.ndarray, "N 3"]) -> Gaussians:
    """Flat Gaussians at `points` facing along `normals`, features zero."""
    count = len(points)
    blob_m2 = 2 * math.pi * START_SCALES_M[0] * START_SCALES_M[1]
    layers = START_COVERAGE * SILHOUETTE_M2 / (max(count, 1) * blob_m2)
    opacity = torch.full((count,), min(layers, 0.5))
    return Gaussians(
        means=torch.from_numpy(np.ascontiguousarray(points)).float(),
        quats=quats_from_normals(normals),
        log_scales=torch.log(torch.tensor(START_SCALES_M)).repeat(count, 1),
        logit_opacities=torch.logit(opacity),
        features=torch.zeros(count, FEATURE_DIM),
    )
