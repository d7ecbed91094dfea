# SPDX-License-Identifier: Apache-2.0
"""Training losses: eq. 4–7 of the paper, and the channel error of the propagation model."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from rfgs_core.fit.nearest import nearest_gaussian
from rfgs_core.gaussians import Gaussians

#: Weights λ1, λ2, λ3 of eq. 4 (paper section 3.4).
POSITION_WEIGHT, FEATURE_WEIGHT, REGULARISATION_WEIGHT = 1.0, 0.1, 0.001


@dataclass(frozen=True)
class SamplePoints:
    """Sample points of the radio measurement grid and what the encoder says there."""

    xyz: Float[Tensor, "N 3"]
    """Positions p_k [m]."""
    features: Float[Tensor, "N 32"]
    """φ(p_k), which the losses take as a constant."""

    def rows(self, chosen: Int64[Tensor, "batch"]) -> SamplePoints:
        """Some of the points."""
        return SamplePoints(self.xyz[chosen], self.features[chosen])


def position_loss(
    gaussians: Gaussians,
    points: SamplePoints,
    nearest: Int64[Tensor, "N"],
    weighted: bool = True,
) -> Float[Tensor, ""]:
    """Eq. 5: Σ_k ‖φ(p_k)‖ ‖μ_nn(k) − p_k‖², or all points alike for the ablation without weights.

    Sample points have RMS ‖φ‖ = 1, so that neither form is louder than the other.
    """
    square = torch.sum((gaussians.means[nearest] - points.xyz) ** 2, dim=1)
    if not weighted:
        return torch.sum(square)
    return torch.sum(torch.linalg.norm(points.features.detach(), dim=1) * square)


def feature_loss(
    gaussians: Gaussians, points: SamplePoints, nearest: Int64[Tensor, "N"]
) -> Float[Tensor, ""]:
    """Eq. 6: Σ_k ‖f_nn(k) − φ(p_k)‖².

    The gradient stops at φ: an encoder that could move would fall to zero with the Gaussians.
    """
    return torch.sum((gaussians.features[nearest] - points.features.detach()) ** 2)


def regularisation_loss(gaussians: Gaussians) -> Float[Tensor, ""]:
    """Eq. 7: Σ_i ‖s_i‖² + |log α_i|."""
    opacity = torch.nn.functional.logsigmoid(gaussians.logit_opacities)
    return torch.sum(gaussians.scales**2) + torch.sum(opacity.abs())


def paper_loss(
    gaussians: Gaussians, points: SamplePoints, weighted: bool = True
) -> Float[Tensor, ""]:
    """Eq. 4: λ1 L_pos + λ2 L_feat + λ3 L_reg over one batch of sample points."""
    nearest, _ = nearest_gaussian(points.xyz, gaussians.means)
    return (
        POSITION_WEIGHT * position_loss(gaussians, points, nearest, weighted)
        + FEATURE_WEIGHT * feature_loss(gaussians, points, nearest)
        + REGULARISATION_WEIGHT * regularisation_loss(gaussians)
    )


def channel_loss(
    predicted: Tensor,
    target: Tensor,
    noise: Float[Tensor, "link"],
) -> Float[Tensor, ""]:
    """Mean squared channel error in units of each link's own noise variance.

    Predicted and measured entries (link, entry) may be complex or, of radios without phase, real.
    """
    return torch.mean((predicted - target).abs() ** 2 / noise[:, None])
