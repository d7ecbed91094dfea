# SPDX-License-Identifier: Apache-2.0
"""Density control by back-projection: Gaussians come where the residual channel still echoes.

What the prediction leaves of the measured change is put through the matched filter, and new
Gaussians stand at the peaks of the log-mean over device pairs. Their reflectivities are the
posterior mean that explains the residual. Gaussians that reflect next to nothing go.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float64
from scipy.ndimage import maximum_filter
from scipy.spatial import KDTree
from torch import Tensor

from rfgs_core.bodies.body_prior import Bodies, outward_normals
from rfgs_core.bodies.localise import PairMaps, pair_maps
from rfgs_core.device import on_device
from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.parameters import TrainableGaussians
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import Comparison
from rfgs_core.model.first_gaussians import gaussians_at
from rfgs_core.model.head import RadioHead
from rfgs_core.model.reflectivity import posterior_mean


@dataclass(frozen=True)
class ResidualRule:
    """Schedule and thresholds."""

    every: int = 20
    """Steps between densifications; the last `every` steps only fit."""
    least_peak: float = 4.0
    """Peaks stand out of the map's mean by this factor."""
    reach_m: float = 0.5
    """New Gaussians are at most this far from one that is there [m]."""
    most_share: float = 0.02
    """At most this share of the Gaussians comes at once, though one at least."""
    least_energy: float = 1e-3
    """Gaussians with less than this share of the mean |γ|² go."""
    least_opacity: float = 0.005
    """Gaussians more transparent than this go."""
    solver_steps: int = 8
    """Conjugate-gradient steps for the new reflectivities."""
    cap: int = 1_500_000
    """Most Gaussians."""


def residual_peaks(
    maps: PairMaps, near_m: Float64[np.ndarray, "M 3"], rule: ResidualRule
) -> Float64[np.ndarray, "peak 3"]:
    """Highest local maxima of the log-mean map within reach of `near_m`, highest first."""
    score = np.exp(np.log(maps.power + 1e-3).mean(axis=0))
    peak = (score == maximum_filter(score, size=3)) & (score > rule.least_peak * score.mean())
    index = np.argwhere(peak)
    index = index[np.argsort(-score[tuple(index.T)], kind="stable")]
    points = maps.origin_m + maps.spacing_m * index
    if len(points) == 0:
        return points
    distance_m, _ = KDTree(near_m).query(points)
    return points[np.asarray(distance_m) <= rule.reach_m]


@dataclass
class ResidualDensity:
    """Adds Gaussians at peaks of the residual and drops those without energy."""

    rule: ResidualRule
    """Schedule and thresholds."""
    observations: Observations
    """What was measured."""
    channel: Channel
    """Its visible links and subcarriers."""
    comparison: Comparison
    """The terms of the measurement."""
    noise: Tensor
    """Variance per link that need not be explained."""
    head: RadioHead
    """Decodes reflectivities."""
    bodies: Bodies
    """The bodies, which new Gaussians face away from."""
    iterations: int
    """Steps of the whole descent."""

    def after_step(
        self, step: int, trained: TrainableGaussians, points: SamplePoints | None
    ) -> None:
        """See `DensityControl`; sample points play no part."""
        if step % self.rule.every or step + self.rule.every > self.iterations:
            return
        g = trained.gaussians.detach()
        energy = self.head.gamma(g.features).abs() ** 2
        drop = energy < self.rule.least_energy * energy.mean()
        drop |= g.opacities < self.rule.least_opacity
        drop &= ~drop.all()
        new = self._new(g, energy)
        if bool(drop.any()) or len(new):
            trained.edit_rows(~drop, new)

    def _new(self, g: Gaussians, energy: Tensor) -> Gaussians:
        with torch.no_grad():
            change = self.channel.change(self.head, g)
        remaining = self.comparison.residual(self.observations, change)
        room = min(self.rule.cap - len(g), max(1, int(self.rule.most_share * len(g))))
        if not remaining.changed or room <= 0:
            return Gaussians.none()
        near_m = g.means.double().cpu().numpy()
        points = residual_peaks(pair_maps(remaining), near_m, self.rule)[:room]
        new = gaussians_at(points, outward_normals(points, self.bodies))
        new = on_device(new, g.means.device)
        new = replace(new, logit_opacities=g.logit_opacities.median().expand(len(new)).clone())
        power = energy.median().expand(len(new))
        gamma = torch.polar(power.sqrt(), torch.zeros_like(power))
        if len(new) and remaining.kind != "delay_power":
            residual = self.comparison.measured() - self.comparison.predicted(
                change, np.arange(len(self.channel.links))
            )
            gamma = posterior_mean(
                self.channel,
                self.head,
                new,
                target=residual,
                noise=self.noise,
                power=energy.mean().expand(len(new)),
                iterations=self.rule.solver_steps,
                comparison=self.comparison,
            )
        return replace(new, features=self.head.with_gamma(new.features, gamma))

    def state(self) -> dict[str, np.ndarray]:
        """Nothing: the residual follows from the parameters."""
        return {}

    def resume(self, memory: Mapping[str, Tensor]) -> None:
        """See `DensityControl`."""
