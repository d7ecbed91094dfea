# SPDX-License-Identifier: Apache-2.0
"""The paper's ablation: each variant leaves out what it says."""

from __future__ import annotations

import sys

import pytest
import torch

from rfgs_core.fit.density import DensityRule
from rfgs_core.fit.losses import SamplePoints, position_loss
from rfgs_core.gaussians import Gaussians


def test_parts_leave_the_rule_one_by_one() -> None:
    assert DensityRule.without(()) == DensityRule()
    assert DensityRule.without(("densify",)) == DensityRule(densify_every=sys.maxsize)
    assert DensityRule.without(("prune",)) == DensityRule(prune_every=sys.maxsize)
    assert DensityRule.without(("feature_gradients",)) == DensityRule(gradient_threshold=0.0)
    assert DensityRule.without(("rf_weights",)) == DensityRule()


def test_without_weights_every_point_counts_alike() -> None:
    gaussians = Gaussians.none()
    gaussians.means = torch.zeros(1, 3)
    points = SamplePoints(torch.tensor([[1.0, 0, 0], [0, 2.0, 0]]), torch.zeros(2, 32))
    points.features[0, 0] = 5.0
    nearest = torch.tensor([0, 0])
    assert position_loss(gaussians, points, nearest).item() == pytest.approx(5.0)
    assert position_loss(gaussians, points, nearest, weighted=False).item() == pytest.approx(5.0)
    points.features[1, 0] = 1.0
    assert position_loss(gaussians, points, nearest).item() == pytest.approx(9.0)
    assert position_loss(gaussians, points, nearest, weighted=False).item() == pytest.approx(5.0)
