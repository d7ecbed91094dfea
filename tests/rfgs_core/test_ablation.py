# SPDX-License-Identifier: Apache-2.0
"""The paper's ablation: each variant leaves out what it says, and the table tells what it cost."""

from __future__ import annotations

import sys

import pytest
import torch

from rfgs_core.fit.density import DensityRule
from rfgs_core.fit.losses import SamplePoints, position_loss
from rfgs_core.gaussians import Gaussians
from rfgs_core.study.ablation import VARIANTS, ablation_row, ablation_table


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


def test_the_table_tells_what_each_part_is_worth() -> None:
    rows = [
        ablation_row(variant, {"geometry": {"f05": 0.5, "f10": 0.7 - 0.1 * k}, "train_s": 60}, 100)
        for k, variant in enumerate(VARIANTS[:2])
    ]
    lines = ablation_table(rows).splitlines()
    assert lines[2] == "| full | 0.500 | 0.700 | – | 100 | 60 s | 33.7 |"
    assert lines[3] == "| w/o RF-weighted loss | 0.500 | 0.600 | -0.100 | 100 | 60 s | 28.3 |"
    assert "claimed, not reproduced" in lines[-1] + lines[-2]
