# SPDX-License-Identifier: Apache-2.0
"""Where the first Gaussians are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rfgs_core.bodies.body_prior import Bodies, nearest_axis, surface_prior
from rfgs_core.bodies.localise import PairMaps
from rfgs_core.bodies.start import CELL_M, CROSS_SECTION_M2, HEIGHT_EVIDENCE, StartDensity

#: No whole number of the grid's 4 cm cells.
BOUNDS_M = np.array([[0.0, 0.0, 0.1], [1.55, 1.49, 1.45]])


def flat_maps(power: np.ndarray | None = None) -> PairMaps:
    """Maps that prefer no place, or the given ones."""
    power = np.ones((2, 8, 8, 10), np.float32) if power is None else power
    ends = np.zeros((len(power), 3))
    return PairMaps(power, np.array([0.1, 0.1, 0.2]), 0.2, ends, ends)


def test_without_evidence_the_density_is_the_prior() -> None:
    bodies = Bodies.standing(np.array([[0.7, 0.7]]))
    density = StartDensity.of(flat_maps(), bodies, BOUNDS_M)
    covered_m = density.low_m + CELL_M * np.array(density.share.shape)
    places = np.random.default_rng(0).uniform(density.low_m, covered_m, (200, 3))
    cells = density.low_m + (np.floor((places - density.low_m) / CELL_M) + 0.5) * CELL_M
    prior = np.exp(surface_prior(cells, bodies)[0])
    got = density.at(places)
    np.testing.assert_allclose(got / got.sum(), prior / prior.sum(), rtol=1e-6)
    assert density.share.sum() == pytest.approx(1.0)
    assert density.at(BOUNDS_M - 5.0).tolist() == [0.0, 0.0]


def test_within_a_height_density_follows_the_maps_with_a_quarter_power() -> None:
    power = np.ones((2, 8, 8, 10), np.float32)
    power[0, 4:] = math.exp(8.0)
    bodies = Bodies.standing(np.array([[0.7, 0.7]]))
    loud = StartDensity.of(flat_maps(power), bodies, BOUNDS_M).share
    plain = StartDensity.of(flat_maps(), bodies, BOUNDS_M).share
    lift = np.log(loud / plain)
    # Mean of the two maps' logarithms, 8 and 0, times a quarter.
    np.testing.assert_allclose(lift[-1] - lift[0], 1.0, atol=1e-3)


def test_between_heights_it_follows_them_far_less() -> None:
    power = np.full((2, 8, 8, 10), 1.0, np.float32)
    power[:, :, :, 5:] = math.exp(8.0)
    bodies = Bodies.standing(np.array([[0.7, 0.7]]))
    loud = StartDensity.of(flat_maps(power), bodies, BOUNDS_M).share.sum(axis=(0, 1))
    plain = StartDensity.of(flat_maps(), bodies, BOUNDS_M).share.sum(axis=(0, 1))
    lift = np.log(loud / plain)
    assert lift[-1] - lift[0] == pytest.approx(0.25 * 8.0 * HEIGHT_EVIDENCE, abs=1e-3)


def test_heights_seen_sharply_do_not_outshine_blurred_ones() -> None:
    """Of the cells that a body fills, as many lie where the maps are flat as where they peak."""
    power = np.ones((2, 8, 8, 10), np.float32)
    power[:, 3:5, 3:5, 5:] = math.exp(8.0)
    share = StartDensity.of(
        flat_maps(power), Bodies.standing(np.array([[0.7, 0.7]])), BOUNDS_M
    ).share
    top = round(1.6 / CELL_M)
    body = np.sort(share[:, :, :top].ravel())[-round(CROSS_SECTION_M2 / CELL_M**2) * top :]
    filled = (share >= body[0])[:, :, :top].sum(axis=(0, 1))
    flat, sharp = filled[: top // 2].mean(), filled[-top // 2 :].mean()
    assert flat == pytest.approx(sharp, rel=0.25)


def test_a_loud_body_gets_no_more_gaussians_than_a_quiet_one() -> None:
    bounds_m = np.array([[0.0, 0.0, 0.0], [4.0, 2.0, 2.0]])
    power = np.ones((2, 20, 10, 10), np.float32)
    power[:, :10] = 100.0
    axes = np.array([[1.0, 1.0], [3.0, 1.0]])
    points = StartDensity.of(flat_maps(power), Bodies.standing(axes), bounds_m).draw(
        20_000, np.random.default_rng(3)
    )
    counts = np.bincount(nearest_axis(points, axes))
    assert counts[0] == pytest.approx(10_000, abs=5 * math.sqrt(5000))


def test_a_body_on_the_slope_of_a_louder_one_gets_as_many() -> None:
    """Its side towards the other peaks: by its likeliest cells alone it would get fewer."""
    bounds_m = np.array([[0.0, 0.0, 0.0], [4.0, 2.0, 2.0]])
    x = 0.1 + 0.2 * np.arange(20)
    slope = np.exp(-12.0 * np.abs(x - 1.0)).astype(np.float32)
    power = np.broadcast_to(slope[:, None, None], (2, 20, 10, 10)).copy()
    axes = np.array([[1.0, 1.0], [2.04, 1.0]])
    for bodies in (Bodies.standing(axes), Bodies(axes, np.array([np.nan, 0.0]))):
        density = StartDensity.of(flat_maps(power), bodies, bounds_m)
        even = density.even(bodies)
        middle = round((1.52 - 0.2) / CELL_M)
        assert even.share[:middle].sum() == pytest.approx(0.5, rel=1e-9)
        assert density.share[:middle].sum() != pytest.approx(0.5, rel=0.05)
        # Within a body nothing changes.
        for part in (np.s_[:middle], np.s_[middle:]):
            own, before = even.share[part], density.share[part]
            np.testing.assert_allclose(own / own.sum(), before / before.sum())
    alone = StartDensity.of(flat_maps(power), Bodies.standing(axes[:1]), bounds_m)
    assert alone.even(Bodies.standing(axes[:1])) is alone


@pytest.mark.parametrize("axis", [(0.75, 0.7), (0.13, 0.13), (1.4, 1.34)])
def test_drawn_points_stay_in_bounds(axis: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    points = StartDensity.of(flat_maps(), Bodies.standing(np.array([axis])), BOUNDS_M).draw(
        4000, rng
    )
    assert points.shape == (4000, 3)
    assert (points >= BOUNDS_M[0]).all()
    assert (points <= BOUNDS_M[1]).all()
    # They fill the bounds too: the wall is reached where the body stands at it.
    assert np.abs(points[:, :2] - axis).max(axis=0).min() > 0.3


def test_drawn_points_follow_the_density() -> None:
    bounds_m = np.array([[-2.0, -2.0, 0.0], [2.0, 2.0, 2.5]])
    rng = np.random.default_rng(2)
    points = StartDensity.of(flat_maps(), Bodies.standing(np.array([[0.1, -0.2]])), bounds_m).draw(
        20_000, rng
    )
    radius = points[:, :2] - [0.1, -0.2]
    # 5 standard errors; cells of 4 cm widen a standard deviation of 0.2 m by 0.2 %.
    error = 5 * 0.2 / math.sqrt(2 * 20_000)
    np.testing.assert_allclose(radius.std(axis=0), 0.2, atol=error + 0.001)
    np.testing.assert_allclose(radius.mean(axis=0), 0, atol=5 * 0.2 / math.sqrt(20_000))
    below = points[points[:, 2] < 1.6, 2]
    assert below.mean() == pytest.approx(0.8, abs=5 * 1.6 / math.sqrt(12 * 20_000))
    # Mass above: 0.08 sqrt(π/2) against 1.6.
    share = 0.08 * math.sqrt(math.pi / 2) / (1.6 + 0.08 * math.sqrt(math.pi / 2))
    deviation = math.sqrt(share * (1 - share) / 20_000)
    assert 1 - len(below) / 20_000 == pytest.approx(share, abs=5 * deviation)


def test_the_draw_is_that_of_its_seed() -> None:
    bodies = Bodies.standing(np.array([[0.7, 0.7]]))
    draws = [
        StartDensity.of(flat_maps(), bodies, BOUNDS_M).draw(50, np.random.default_rng(seed))
        for seed in (0, 0, 1)
    ]
    np.testing.assert_array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])
