# SPDX-License-Identifier: Apache-2.0
"""The paper's losses on numbers worked out by hand."""

from __future__ import annotations

import math

import pytest
import torch

from rfgs_core.fit.losses import (
    SamplePoints,
    channel_loss,
    feature_loss,
    paper_loss,
    position_loss,
    regularisation_loss,
)
from rfgs_core.gaussians import Gaussians


@pytest.fixture
def gaussians() -> Gaussians:
    """Two Gaussians at x = 0 and x = 10, opacities 1/2 and 1/4."""
    features = torch.zeros(2, 32)
    features[0, 0] = 2.0
    features[1, 1] = 1.0
    return Gaussians(
        means=torch.tensor([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]),
        quats=torch.tensor([[1.0, 0.0, 0.0, 0.0]] * 2),
        log_scales=torch.log(torch.tensor([[1.0, 2.0, 3.0], [0.5, 0.5, 0.5]])),
        logit_opacities=torch.logit(torch.tensor([0.5, 0.25])),
        features=features,
    )


@pytest.fixture
def points() -> SamplePoints:
    """Points 1, 2 and 3 m from the first, the first and the second Gaussian."""
    features = torch.zeros(3, 32)
    features[0, 0], features[0, 1] = 3.0, 4.0
    features[1, 2] = 0.5
    return SamplePoints(torch.tensor([[1.0, 0, 0], [0, 2.0, 0], [7.0, 0, 0]]), features)


def test_equation_5(gaussians: Gaussians, points: SamplePoints) -> None:
    # 5 · 1² + 0.5 · 2² + 0 · 3²
    loss = position_loss(gaussians, points, torch.tensor([0, 0, 1]))
    assert loss.item() == pytest.approx(7.0, rel=1e-6)


def test_equation_6(gaussians: Gaussians, points: SamplePoints) -> None:
    # (2 − 3)² + (0 − 4)², 2² + 0.5², 1².
    loss = feature_loss(gaussians, points, torch.tensor([0, 0, 1]))
    assert loss.item() == pytest.approx(17.0 + 4.25 + 1.0, rel=1e-6)


def test_equation_7(gaussians: Gaussians) -> None:
    # 1 + 4 + 9, 3 · 0.25, ln 2 + ln 4.
    expected = 14.0 + 0.75 + math.log(8.0)
    assert regularisation_loss(gaussians).item() == pytest.approx(expected, rel=1e-6)


def test_equation_4_weighs_them_1_to_a_tenth_to_a_thousandth(
    gaussians: Gaussians, points: SamplePoints
) -> None:
    expected = 7.0 + 0.1 * 22.25 + 0.001 * (14.75 + math.log(8.0))
    assert paper_loss(gaussians, points).item() == pytest.approx(expected, rel=1e-6)


def test_opacities_near_zero_and_one_stay_finite(gaussians: Gaussians) -> None:
    gaussians.logit_opacities = torch.tensor([-200.0, 200.0], requires_grad=True)
    loss = regularisation_loss(gaussians)
    assert loss.item() == pytest.approx(14.75 + 200.0, rel=1e-6)
    loss.backward()
    assert gaussians.logit_opacities.grad is not None
    assert torch.isfinite(gaussians.logit_opacities.grad).all()


def test_rows_of_points(points: SamplePoints) -> None:
    rows = points.rows(torch.tensor([2, 0]))
    assert rows.xyz[:, 0].tolist() == [7.0, 1.0]
    assert torch.equal(rows.features, points.features[[2, 0]])


def test_channel_loss_is_in_units_of_the_noise() -> None:
    predicted = torch.tensor([[1 + 1j, 0j], [3j, 0j]], dtype=torch.complex64)
    target = torch.tensor([[0j, 0j], [0j, 4.0]], dtype=torch.complex64)
    # (2/0.5 + 0/0.5 + 9/5 + 16/5) / 4.
    loss = channel_loss(predicted, target, torch.tensor([0.5, 5.0]))
    assert loss.item() == pytest.approx((4.0 + 5.0) / 4, rel=1e-6)
