# SPDX-License-Identifier: Apache-2.0
"""Keeps Gaussians where they were on their body from frame to frame (paper section 4.7).

A frame starts from the earlier Gaussians, moved along with their bodies. The term pulls those
that go on towards that start, in units of what a limb moves against the trunk between frames;
Gaussians that came anew are free.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from rfgs_core.gaussians import Gaussians

#: Step of a limb against its trunk that costs as much as the whole channel error of a link [m].
STEP_M = 0.05


@dataclass(frozen=True)
class Continuity:
    """Where the Gaussians that go on are expected."""

    expected: Float[Tensor, "start 3"]
    """Positions at the start of the frame [m]."""
    goes_on: Bool[Tensor, "start"]
    """Which of them were there in the frame before."""
    weight: float
    """Weight of the term beside the channel's loss."""

    def loss(self, gaussians: Gaussians, origin: Int64[Tensor, "M"]) -> Float[Tensor, ""]:
        """Mean squared step away from the start, in units of `STEP_M`.

        Args:
            gaussians: Present Gaussians.
            origin: Row at the start that each one is or stems from; −1: none.
        """
        rows = torch.nonzero((origin >= 0) & self.goes_on[origin.clamp(min=0)])[:, 0]
        if not len(rows):
            return gaussians.means.new_zeros(())
        step = (gaussians.means[rows] - self.expected[origin[rows]]) / STEP_M
        return self.weight * torch.mean(torch.sum(step**2, dim=1))
