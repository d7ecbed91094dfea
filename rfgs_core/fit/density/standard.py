# SPDX-License-Identifier: Apache-2.0
"""The density control of 3D Gaussian splatting (Kerbl et al., ACM TOG 42, 2023, section 5.2).

Where positions are pulled hard on average, small Gaussians are cloned and large ones split in
two; transparent and huge ones go; opacities are reset now and then. The published threshold is
one of screen-space gradients, which a radio does not have: here it is a multiple of the mean
over the Gaussians. "Large" counts against the extent of the antennas, as against that of the
cameras there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from jaxtyping import Bool
from torch import Tensor

from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.parameters import TrainableGaussians
from rfgs_core.gaussians import Gaussians
from rfgs_core.seeds import sub_seed


@dataclass(frozen=True)
class StandardRule:
    """Thresholds, published ones where there are any."""

    densify_every: int = 100
    """Steps between densifications."""
    densify_from: int = 500
    """First step that may densify."""
    densify_until: int = 15_000
    """Last step that may densify."""
    reset_every: int = 3000
    """Steps between resets of opacity, while densifying."""
    gradient_factor: float = 2.0
    """A Gaussian is pulled hard from this multiple of the mean gradient on."""
    dense_share: float = 0.01
    """Gaussians wider than this share of the extent are split, others cloned."""
    shrink: float = 1.6
    """The halves of a split are narrower by this factor."""
    least_opacity: float = 0.005
    """Gaussians more transparent than this go."""
    greatest_share: float = 0.1
    """Gaussians wider than this share of the extent go."""
    reset_opacity: float = 0.01
    """Opacities are at most this after a reset."""
    cap: int = 1_500_000
    """Most Gaussians."""

    @staticmethod
    def for_steps(iterations: int) -> StandardRule:
        """The published schedule of 30,000 steps, shrunk to fewer.

        A pause is at least ten steps long, so that gradients can be averaged.
        """
        share = min(1.0, iterations / 30_000)
        every = min(100, max(10, iterations // 100))
        return StandardRule(
            densify_every=every,
            densify_from=math.ceil(500 * share),
            densify_until=math.ceil(15_000 * share),
            reset_every=max(5 * every, math.ceil(3000 * share)),
        )


def _children(parents: Gaussians, shrink: float, generator: torch.Generator) -> Gaussians:
    """Two narrower Gaussians drawn from each parent: all first ones, then all second ones."""
    twice = Gaussians.join(parents, parents)
    # Drawn on the CPU: the same numbers whatever the device.
    drawn = torch.randn(twice.means.shape, generator=generator).to(twice.means.device)
    drawn = drawn * twice.scales
    offset = torch.einsum("mij,mj->mi", twice.rotations, drawn)
    return replace(
        twice, means=twice.means + offset, log_scales=twice.log_scales - math.log(shrink)
    )


@dataclass
class StandardDensity:
    """Clone, split, prune and reset."""

    rule: StandardRule
    """Schedule and thresholds."""
    extent_m: float
    """Extent of the antennas [m]."""
    seed: int = 0
    """Seed of the places of split Gaussians."""
    gradient_sum: Tensor = field(default_factory=lambda: torch.zeros(0))
    """Norm of each position's gradient, summed since the last densification."""
    steps: int = 0
    """How many steps that sum holds."""

    def after_step(
        self, step: int, trained: TrainableGaussians, points: SamplePoints | None
    ) -> None:
        """See `DensityControl`; sample points play no part."""
        rule = self.rule
        if step > rule.densify_until:
            return
        if len(self.gradient_sum) != len(trained.gaussians):
            self._forget(trained)
        gradient = trained.leaves["means"].grad
        if gradient is not None:
            self.gradient_sum = self.gradient_sum + torch.linalg.norm(gradient, dim=1)
            self.steps += 1
        if step >= rule.densify_from and step % rule.densify_every == 0:
            self._densify(step, trained)
            self._forget(trained)
        if step % rule.reset_every == 0:
            top = math.log(rule.reset_opacity / (1 - rule.reset_opacity))
            logits = trained.gaussians.logit_opacities.detach().clamp(max=top)
            everyone = torch.ones_like(logits, dtype=torch.bool)
            trained.edit_rows(everyone, replaced={"logit_opacities": logits})

    def _forget(self, trained: TrainableGaussians) -> None:
        self.gradient_sum = trained.leaves["means"].new_zeros(len(trained.gaussians))
        self.steps = 0

    def _densify(self, step: int, trained: TrainableGaussians) -> None:
        g = trained.gaussians.detach()
        widest_m = g.scales.max(dim=1).values
        drop = g.opacities < self.rule.least_opacity
        drop |= widest_m > self.rule.greatest_share * self.extent_m
        if bool(drop.all()):
            return
        hot = self._hot(~drop, self.rule.cap - int((~drop).sum()))
        large = widest_m > self.rule.dense_share * self.extent_m
        clone, split = hot & ~large, hot & large
        generator = torch.Generator().manual_seed(sub_seed(self.seed, "split", step))
        children = _children(g.select(split), self.rule.shrink, generator)
        rows = torch.arange(len(g), device=trained.device)
        trained.edit_rows(
            ~drop & ~split,
            Gaussians.join(g.select(clone), children),
            parents=torch.cat([rows[clone], rows[split], rows[split]]),
        )

    def _hot(self, alive: Bool[Tensor, "M"], room: int) -> Bool[Tensor, "M"]:
        """Living Gaussians that are pulled hard, the hardest first while there is room."""
        mean = self.gradient_sum / max(self.steps, 1)
        hot = alive & (mean > self.rule.gradient_factor * mean.mean())
        if int(hot.sum()) > room:
            order = torch.argsort(torch.where(hot, mean, -1.0), descending=True, stable=True)
            hot = torch.zeros_like(hot).index_fill(0, order[: max(room, 0)], True)
        return hot

    def state(self) -> dict[str, np.ndarray]:
        """Gradients since the last densification."""
        gradient_sum = self.gradient_sum.cpu().numpy()
        return {"gradient_sum": gradient_sum, "gradient_steps": np.array(self.steps)}

    def resume(self, memory: Mapping[str, Tensor]) -> None:
        """See `DensityControl`."""
        if "gradient_sum" in memory and "gradient_steps" in memory:
            self.gradient_sum = memory["gradient_sum"]
            self.steps = int(memory["gradient_steps"])
