# SPDX-License-Identifier: Apache-2.0
"""Gaussians as a fit begins with them: flat, of one size, facing along given normals."""

from __future__ import annotations

import math

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.gaussians import FEATURE_DIM, Gaussians

#: Standard deviation of a new Gaussian along the surface and across it [m].
START_SCALES_M = (0.04, 0.04, 0.025)
#: Standard deviation [m] and opacity of a Gaussian that knows of no surface (paper section 3.5).
LONE_SCALE_M, LONE_OPACITY = 0.01, 0.1
#: Layers that the new Gaussians put on a body's silhouette. The shadow model multiplies
#: transmissions of complex blobs, which is only sound while few layers overlap.
START_COVERAGE = 1.5
#: Silhouette of a standing body [m²].
SILHOUETTE_M2 = 0.75


def quats_from_normals(normals: Float[np.ndarray, "N 3"]) -> Float[Tensor, "N 4"]:
    """Rotations that turn local +Z into the given unit normals, w first."""
    axis = np.cross([0.0, 0.0, 1.0], normals)
    quats = np.concatenate([1.0 + normals[:, 2:], axis], axis=1)
    upside_down = quats[:, 0] < 1e-9
    quats[upside_down] = [0.0, 1.0, 0.0, 0.0]
    return torch.from_numpy(quats / np.linalg.norm(quats, axis=1, keepdims=True)).float()


def gaussians_at(
    points: Float[np.ndarray, "N 3"],
    normals: Float[np.ndarray, "N 3"],
    scales_m: tuple[float, float, float] = START_SCALES_M,
) -> Gaussians:
    """Gaussians of one size at `points` facing along `normals`, features zero."""
    count = len(points)
    blob_m2 = 2 * math.pi * scales_m[0] * scales_m[1]
    layers = START_COVERAGE * SILHOUETTE_M2 / (max(count, 1) * blob_m2)
    opacity = torch.full((count,), min(layers, 0.5))
    return Gaussians(
        means=torch.from_numpy(np.ascontiguousarray(points)).float(),
        quats=quats_from_normals(normals),
        log_scales=torch.log(torch.tensor(scales_m)).repeat(count, 1),
        logit_opacities=torch.logit(opacity),
        features=torch.zeros(count, FEATURE_DIM),
    )


def lone_gaussians(
    xyz: Float[Tensor, "N 3"],
    features: Float[Tensor, "N 32"],
    scale_m: float = LONE_SCALE_M,
    opacity: float = LONE_OPACITY,
) -> Gaussians:
    """Small round Gaussians that no surface turns, as the paper's density control makes them."""
    count = len(xyz)
    quats = xyz.new_zeros(count, 4)
    quats[:, 0] = 1.0
    return Gaussians(
        means=xyz,
        quats=quats,
        log_scales=torch.full_like(xyz, math.log(scale_m)),
        logit_opacities=xyz.new_full((count,), math.log(opacity / (1.0 - opacity))),
        features=features,
    )
