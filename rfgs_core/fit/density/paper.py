# SPDX-License-Identifier: Apache-2.0
"""Adaptive density control (paper section 3.5), with the readings of `docs/method.md`."""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.spatial import KDTree
from torch import Tensor

from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.nearest import nearest_gaussian
from rfgs_core.fit.parameters import TrainableGaussians
from rfgs_core.model.first_gaussians import LONE_OPACITY, LONE_SCALE_M, lone_gaussians


@dataclass(frozen=True)
class DensityRule:
    """Thresholds of section 3.5."""

    densify_every: int = 100
    """Steps between densifications."""
    prune_every: int = 50
    """Steps between prunings."""
    distance_factor: float = 2.0
    """A point is poorly covered when its nearest Gaussian is this many medians away."""
    gradient_threshold: float = 0.1
    """τ: least gradient of φ over frequency bins."""
    scale_m: float = LONE_SCALE_M
    """Standard deviation of a new Gaussian [m]."""
    opacity: float = LONE_OPACITY
    """Opacity of a new Gaussian."""
    least_opacity: float = 0.005
    """Gaussians more transparent than this go."""
    greatest_error: float = 0.05
    """Gaussians whose features miss by more than this, on average over a window, go."""
    error_window: int = 10
    """Steps over which the feature error is averaged."""
    least_spacing_m: float = 0.01
    """Of two Gaussians closer than this, the more transparent one goes [m]."""
    cap: int = 1_500_000
    """Most Gaussians."""

    @staticmethod
    def without(parts: Collection[str]) -> DensityRule:
        """The rule less what an ablation leaves out: densify, feature_gradients, prune.

        What is left out never comes due, or asks for nothing.
        """
        never = sys.maxsize
        kept = DensityRule()
        return replace(
            kept,
            densify_every=never if "densify" in parts else kept.densify_every,
            gradient_threshold=0.0 if "feature_gradients" in parts else kept.gradient_threshold,
            prune_every=never if "prune" in parts else kept.prune_every,
        )


def frequency_gradient(features: Float[Tensor, "N 32"]) -> Float[Tensor, "N"]:
    """‖∇φ‖ by central differences over the frequency-ordered entries, Δf one bin."""
    return torch.linalg.norm((features[:, 2:] - features[:, :-2]) / 2.0, dim=1)


def redundant(
    means: Float[Tensor, "M 3"], opacities: Float[Tensor, "M"], spacing_m: float
) -> Bool[Tensor, "M"]:
    """Gaussians that have a more opaque neighbour within `spacing_m`."""
    close = KDTree(means.detach().cpu().numpy()).query_pairs(spacing_m, output_type="ndarray")
    marked = np.zeros(len(means), dtype=bool)
    alpha = opacities.detach().cpu().numpy()
    first, second = close[:, 0], close[:, 1]
    marked[np.where(alpha[first] < alpha[second], first, second)] = True
    return torch.from_numpy(marked).to(means.device)


@dataclass
class PaperDensity:
    """The paper's density control, called after every optimisation step.

    Errors are watched where the losses look, on batches. New Gaussians may come at any sample
    point: the median of section 3.5 is over all of them, and no batch bounds the number.
    """

    rule: DensityRule
    """Thresholds."""
    points: SamplePoints
    """All sample points."""
    error_sum: Tensor = field(default_factory=lambda: torch.zeros(0))
    """Feature error of each Gaussian, summed over the current window."""
    error_count: Tensor = field(default_factory=lambda: torch.zeros(0))
    """How many sample points that sum holds."""

    def after_step(
        self, step: int, trained: TrainableGaussians, points: SamplePoints | None
    ) -> None:
        """Watches feature errors, densifies and prunes, see `DensityControl`."""
        assert points is not None
        self._watch(step, trained, points)
        if step % self.rule.prune_every == 0:
            self._prune(trained)
        if step % self.rule.densify_every == 0:
            self._densify(trained)

    def _forget(self) -> None:
        """Begins anew: rows have changed."""
        self.error_sum, self.error_count = torch.zeros(0), torch.zeros(0)

    def _watch(self, step: int, trained: TrainableGaussians, points: SamplePoints) -> None:
        since_prune = step % self.rule.prune_every or self.rule.prune_every
        if len(self.error_sum) != len(trained.gaussians) or since_prune == 1:
            self.error_sum = trained.leaves["means"].new_zeros(len(trained.gaussians))
            self.error_count = torch.zeros_like(self.error_sum)
        if since_prune <= self.rule.prune_every - self.rule.error_window:
            return
        with torch.no_grad():
            g = trained.gaussians
            nearest, _ = nearest_gaussian(points.xyz, g.means)
            error = torch.mean((g.features[nearest] - points.features) ** 2, dim=1)
            self.error_sum.index_add_(0, nearest, error)
            self.error_count.index_add_(0, nearest, torch.ones_like(error))

    def _prune(self, trained: TrainableGaussians) -> None:
        g = trained.gaussians
        poor = self.error_sum / self.error_count.clamp(min=1) > self.rule.greatest_error
        drop = (g.opacities.detach() < self.rule.least_opacity) | poor
        drop |= redundant(g.means, g.opacities, self.rule.least_spacing_m)
        if bool(drop.any()) and not bool(drop.all()):
            trained.edit_rows(~drop)
            self._forget()

    def _densify(self, trained: TrainableGaussians) -> None:
        points = self.points
        _, distance = nearest_gaussian(points.xyz, trained.gaussians.means)
        add = distance > self.rule.distance_factor * distance.median()
        add &= frequency_gradient(points.features) >= self.rule.gradient_threshold
        room = self.rule.cap - len(trained.gaussians)
        chosen = torch.nonzero(add)[:room, 0]
        if len(chosen) == 0:
            return
        at = points.rows(chosen)
        new = lone_gaussians(at.xyz, at.features, self.rule.scale_m, self.rule.opacity)
        trained.edit_rows(torch.ones_like(trained.origin, dtype=torch.bool), new)
        self._forget()

    def state(self) -> dict[str, np.ndarray]:
        """Feature errors of the current window."""
        return {
            "error_sum": self.error_sum.cpu().numpy(),
            "error_count": self.error_count.cpu().numpy(),
        }

    def resume(self, memory: Mapping[str, Tensor]) -> None:
        """See `DensityControl`."""
        if "error_sum" in memory and "error_count" in memory:
            self.error_sum, self.error_count = memory["error_sum"], memory["error_count"]
