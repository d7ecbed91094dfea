# SPDX-License-Identifier: Apache-2.0
"""What the descent of one frame compares with: the channel's entries, sample points, or both."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.device import Device, on_device
from rfgs_core.encode import Encoder
from rfgs_core.fit.frame import FrameState
from rfgs_core.fit.losses import SamplePoints, channel_loss, paper_loss
from rfgs_core.fit.sampling import sample_points
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import Comparison, comparison_of
from rfgs_core.model.first_powers import noise_per_link
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig


@dataclass(frozen=True)
class Task:
    """What one frame's descent compares with."""

    channel: Channel
    """Visible links and subcarriers."""
    comparison: Comparison
    """The terms in which the change is reported."""
    target: Tensor
    """Channel change to explain, (link, entry), in those terms."""
    noise: Float[Tensor, "link"]
    """Variance per link that need not be explained."""
    points: SamplePoints | None
    """Sample points of the paper's losses; None without them."""
    weighted: bool
    """Whether eq. 5 weighs its points by ‖φ‖."""

    def on(self, device: Device) -> Task:
        """The task for Gaussians on a device; links and paths go there when they are used."""
        return replace(on_device(self, device), channel=self.channel)

    @staticmethod
    def of(observations: Observations, config: TrainConfig, seed: int, encoder: Encoder) -> Task:
        """Gathers what the objective needs."""
        points = None
        if config.objective != "csi":
            rng = np.random.default_rng(seed)
            points = sample_points(
                observations, config.grid_side, rng, encoder, config.refine_levels
            )
        comparison = comparison_of(observations)
        target = comparison.measured()
        return Task(
            Channel.of(observations, observations.links, observations.subcarriers),
            comparison,
            target,
            noise_per_link(observations, target, config.unexplained),
            points,
            "rf_weights" not in config.without,
        )


def batch(task: Task, config: TrainConfig, seed: int, step: int) -> tuple[np.ndarray, Tensor]:
    """Links and sample points of a step; a function of the step, so that resuming is exact."""
    rng = np.random.default_rng(sub_seed(seed, "batch", step))
    count = len(task.channel.links)
    wanted = max(1, config.batch_entries // task.channel.subcarriers.num_selected)
    together = task.comparison.together
    if together is None or not count:
        links = np.sort(rng.choice(count, min(wanted, count), replace=False))
    else:
        # Groups in random order until there are enough links, and one group at least.
        order = rng.permutation(int(together.max()) + 1)
        filled = np.cumsum(np.bincount(together)[order])
        links = np.flatnonzero(np.isin(together, order[: 1 + np.searchsorted(filled, wanted)]))
    size = 0 if task.points is None else len(task.points.xyz)
    points = rng.choice(size, min(config.batch_points, size), replace=False) if size else []
    return links, torch.as_tensor(np.asarray(points, dtype=np.int64))


def loss_of(
    task: Task,
    state: FrameState,
    gaussians: Gaussians,
    links: np.ndarray,
    points: SamplePoints | None,
) -> Float[Tensor, ""]:
    """Loss of the Gaussians on a batch's links and sample points."""
    loss = gaussians.means.new_zeros(())
    if points is not None:
        loss = loss + paper_loss(gaussians, points, task.weighted)
    if len(links):
        part = task.channel.rows(links)
        predicted = task.comparison.predicted(part.change(state.head, gaussians), links)
        loss = loss + channel_loss(predicted, task.target[links], task.noise[links])
    return loss
