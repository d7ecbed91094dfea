# SPDX-License-Identifier: Apache-2.0
"""Gaussians that go on are held to their place; new ones are free."""

from __future__ import annotations

import torch

from rfgs_core.fit.refine import STEP_M, Continuity


def test_only_those_that_go_on_are_held(make_gaussians) -> None:
    gaussians = make_gaussians(4)
    start = gaussians.means.clone()
    held = Continuity(start, torch.tensor([True, True, False, True]), 2.0)
    gaussians.means = start.clone()
    gaussians.means[0, 0] += 2 * STEP_M
    gaussians.means[2, 1] += 1.0
    # Row 3 stems from row 1, row 1 came from nowhere.
    origin = torch.tensor([0, -1, 2, 1])
    gaussians.means[3] = start[1] + torch.tensor([0.0, 0.0, STEP_M])
    # Steps of two units and of one, over the two that go on, times the weight.
    assert abs(float(held.loss(gaussians, origin)) - 2.0 * (4.0 + 1.0) / 2) < 1e-4
    assert float(held.loss(gaussians, torch.full((4,), -1))) == 0.0
