# SPDX-License-Identifier: Apache-2.0
"""Section 3.5 of the paper adds and drops exactly the Gaussians that its rules name."""

from __future__ import annotations

import math

import pytest
import torch

from rfgs_core.fit.density import DensityRule, PaperDensity, frequency_gradient, redundant
from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.parameters import LearningRates, TrainableGaussians
from rfgs_core.gaussians import Gaussians


def line_of_gaussians(count: int, spacing_m: float = 1.0) -> Gaussians:
    """Gaussians along x that no rule objects to."""
    means = torch.zeros(count, 3)
    means[:, 0] = spacing_m * torch.arange(count)
    quats = torch.zeros(count, 4)
    quats[:, 0] = 1.0
    return Gaussians(
        means=means,
        quats=quats,
        log_scales=torch.full((count, 3), -3.0),
        logit_opacities=torch.zeros(count),
        features=torch.zeros(count, 32),
    )


def points_at(gaussians: Gaussians) -> SamplePoints:
    """Sample points on the Gaussians that agree with their features."""
    return SamplePoints(gaussians.means.clone(), gaussians.features.clone())


def trainable(gaussians: Gaussians) -> TrainableGaussians:
    return TrainableGaussians(gaussians, LearningRates())


def test_gradient_of_a_ramp_and_of_a_wave() -> None:
    bins = torch.arange(32.0)
    wave = torch.sin(0.3 * bins)
    gradient = frequency_gradient(torch.stack([0.5 * bins, wave, torch.ones(32)]))
    # 30 inner bins of slope 0.5; d/df by central differences of sin is cos · sin(0.3).
    slope = torch.cos(0.3 * bins[1:-1]) * math.sin(0.3)
    expected = [0.5 * math.sqrt(30), torch.linalg.norm(slope).item(), 0.0]
    torch.testing.assert_close(gradient, torch.tensor(expected), rtol=1e-5, atol=1e-6)


def test_the_more_opaque_of_two_stays() -> None:
    means = torch.tensor([[0.0, 0, 0], [0.005, 0, 0], [1.0, 0, 0], [1.0, 0.0099, 0], [2.0, 0, 0]])
    opacities = torch.tensor([0.2, 0.6, 0.9, 0.1, 0.01])
    assert redundant(means, opacities, 0.01).tolist() == [True, False, False, True, False]
    # Of two equals one stays.
    assert redundant(means, torch.full((5,), 0.5), 0.01).sum() == 2
    assert not redundant(means, opacities, 0.004).any()


def test_transparent_gaussians_go() -> None:
    gaussians = line_of_gaussians(4)
    gaussians.logit_opacities = torch.logit(torch.tensor([0.5, 0.0049, 0.0051, 0.001]))
    trained = trainable(gaussians)
    rule = DensityRule()
    PaperDensity(rule, points_at(gaussians)).after_step(
        rule.prune_every, trained, points_at(gaussians)
    )
    assert trained.gaussians.means[:, 0].tolist() == [0.0, 2.0]


def test_close_gaussians_go_by_opacity() -> None:
    gaussians = line_of_gaussians(3, spacing_m=0.02)
    gaussians.means[1, 0] = 0.009
    gaussians.logit_opacities[0] = 1.0
    trained = trainable(gaussians)
    PaperDensity(DensityRule(), points_at(gaussians)).after_step(50, trained, points_at(gaussians))
    assert trained.gaussians.means[:, 0].tolist() == pytest.approx([0.0, 0.04])


def test_errors_count_only_in_the_window_before_pruning() -> None:
    gaussians = line_of_gaussians(3)
    good = points_at(gaussians)
    wrong = points_at(gaussians)
    wrong.features[1] = math.sqrt(0.6)
    # Error 0.6 of the middle one; wrong in 1 of 10 window steps: 0.06 on average, else 0.
    for bad_step, expected in ((40, 3), (41, 2), (50, 2)):
        trained, density = trainable(gaussians), PaperDensity(DensityRule(), good)
        for step in range(1, 51):
            density.after_step(step, trained, wrong if step == bad_step else good)
        assert len(trained.gaussians) == expected, bad_step


def test_errors_are_averaged_over_the_window() -> None:
    """Two bad steps of 0.2: 0.04 on average, below 0.05; three are above it."""
    gaussians = line_of_gaussians(3)
    good, wrong = points_at(gaussians), points_at(gaussians)
    wrong.features[1] = math.sqrt(0.2)
    for bad_steps, expected in ((2, 3), (3, 2)):
        trained, density = trainable(gaussians), PaperDensity(DensityRule(), good)
        for step in range(1, 51):
            density.after_step(step, trained, wrong if step > 50 - bad_steps else good)
        assert len(trained.gaussians) == expected


def test_never_all_are_pruned() -> None:
    gaussians = line_of_gaussians(3)
    gaussians.logit_opacities -= 20.0
    trained = trainable(gaussians)
    PaperDensity(DensityRule(), points_at(gaussians)).after_step(50, trained, points_at(gaussians))
    assert len(trained.gaussians) == 3


@pytest.fixture
def poorly_covered() -> SamplePoints:
    """Points 0.1 m beside Gaussians 0..4; number 5 and 6 are 0.5 m away, 6 without gradient."""
    gaussians = line_of_gaussians(7)
    xyz = gaussians.means.clone()
    xyz[:, 1] = torch.tensor([0.1, 0.1, 0.1, 0.1, 0.1, 0.5, 0.5])
    features = torch.zeros(7, 32)
    # A ramp of slope 0.02 has the gradient 0.02 √30 = 0.1095.
    features[:6] = 0.02 * torch.arange(32)
    return SamplePoints(xyz, features)


def test_poorly_covered_points_with_a_gradient_become_gaussians(
    poorly_covered: SamplePoints,
) -> None:
    start = line_of_gaussians(7)
    trained = trainable(start)
    PaperDensity(DensityRule(), poorly_covered)._densify(trained)
    g = trained.gaussians.detach()
    assert len(g) == 8
    assert torch.equal(g.means[:7], start.means)
    assert torch.equal(g.means[7], poorly_covered.xyz[5])
    assert torch.equal(g.features[7], poorly_covered.features[5])
    torch.testing.assert_close(g.scales[7], torch.full((3,), 0.01))
    assert g.opacities[7].item() == pytest.approx(0.1)
    assert g.quats[7].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_a_gradient_below_the_threshold_adds_nothing(poorly_covered: SamplePoints) -> None:
    trained = trainable(line_of_gaussians(7))
    flatter = SamplePoints(poorly_covered.xyz, 0.9 * poorly_covered.features)
    PaperDensity(DensityRule(), flatter)._densify(trained)
    assert len(trained.gaussians) == 7


def test_the_cap_limits_new_gaussians(poorly_covered: SamplePoints) -> None:
    poorly_covered.features[6] = poorly_covered.features[5]
    for cap, expected in ((7, 7), (8, 8), (100, 9)):
        trained = trainable(line_of_gaussians(7))
        PaperDensity(DensityRule(cap=cap), poorly_covered)._densify(trained)
        assert len(trained.gaussians) == expected


def test_density_changes_every_50_and_every_100_steps(poorly_covered: SamplePoints) -> None:
    """Features fit at the Gaussians, so that errors prune none."""
    gaussians = line_of_gaussians(7)
    gaussians.features = poorly_covered.features.clone()
    gaussians.logit_opacities[0] = -20.0
    trained, density = trainable(gaussians), PaperDensity(DensityRule(), poorly_covered)
    counts = []
    for step in range(1, 201):
        density.after_step(step, trained, poorly_covered)
        counts.append(len(trained.gaussians))
    changes = [step for step in range(2, 201) if counts[step - 1] != counts[step - 2]]
    assert changes == [50, 100]
    # One pruned at 50; at 100 its point has lost its Gaussian, and point 5 never had one.
    assert (counts[48], counts[49], counts[99]) == (7, 6, 8)


def test_new_gaussians_are_not_bounded_by_the_batch() -> None:
    """Every sample point that is poorly covered gets one, whichever of them the step looked at."""
    generator = torch.Generator().manual_seed(0)
    xyz = torch.rand(3000, 3, generator=generator)
    # Four in ten are far away from the Gaussians, among which the other six are.
    xyz[:1200, 0] += 100.0
    everywhere = SamplePoints(xyz, (0.02 * torch.arange(32.0)).repeat(3000, 1))
    trained = trainable(line_of_gaussians(7, spacing_m=0.1))
    density = PaperDensity(DensityRule(), everywhere)
    batch = everywhere.rows(torch.arange(2))
    for step in range(1, 101):
        density.after_step(step, trained, batch)
    # Two points at each of a hundred steps could not have made so many.
    assert len(trained.gaussians) >= 1200 > 2 * 100 + 7
    assert (trained.gaussians.means[:, 0] > 50.0).sum() == 1200
