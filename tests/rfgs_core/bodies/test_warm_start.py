# SPDX-License-Identifier: Apache-2.0
"""What goes on from frame to frame when bodies walk, turn, sit down and stand up."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.bodies.body_prior import Bodies, nearest_axis, surface_prior
from rfgs_core.bodies.localise import PairMaps
from rfgs_core.bodies.start import StartCells, StartDensity
from rfgs_core.bodies.warm_start import Moving, carry_over

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [5.0, 4.0, 2.4]])
EVEN = PairMaps(
    np.ones((1, 5, 4, 3), np.float32), np.zeros(3), 1.0, np.zeros((1, 3)), np.ones((1, 3))
)
COUNT = 900


def fitted(bodies: Bodies) -> Moving:
    points = StartDensity.of(EVEN, bodies, BOUNDS_M).draw(COUNT, np.random.default_rng(0))
    return Moving(points, bodies, np.ones(COUNT), np.arange(COUNT) + 7, COUNT + 7)


def carried(before: Moving, bodies: Bodies, maps: PairMaps = EVEN) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    cells = StartCells.around(maps, bodies.axes_xy, BOUNDS_M)
    density = cells.density(bodies)
    return carry_over(before, bodies, cells, density, density.draw(COUNT, rng), rng)


@pytest.mark.parametrize(("knees", "turn"), [(np.nan, 0.0), (0.3, 0.0), (0.3, 1.1)])
def test_gaussians_keep_their_place_on_a_body_that_walks_or_turns(knees, turn) -> None:
    before = fitted(Bodies(np.array([[1.5, 1.5]]), np.array([knees])))
    now = Bodies(np.array([[2.2, 1.1]]), np.array([knees + turn]))
    points, track_id = carried(before, now)
    stay = track_id < COUNT + 7
    assert stay.sum() == COUNT - COUNT // 3
    np.testing.assert_array_equal(track_id[stay], before.track_id[stay])
    offset = before.points[stay] - [1.5, 1.5, 0]
    where = points[stay] - [2.2, 1.1, 0]
    angle = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    np.testing.assert_allclose(where[:, :2], offset[:, :2] @ angle.T, atol=1e-9)
    np.testing.assert_array_equal(where[:, 2], offset[:, 2])


def test_who_is_hardly_heard_keeps_as_many_from_frame_to_frame() -> None:
    """Its Gaussians have less support than anybody's, and would all be among the weakest third."""
    power = np.ones((1, 26, 21, 13), np.float32)
    power[:, 8:] = 1e-3 + np.exp(-40.0 * np.linspace(0.0, 1.0, 18))[None, :, None, None]
    sharp = PairMaps(power, np.zeros(3), 0.2, np.zeros((1, 3)), np.ones((1, 3)))
    bodies = Bodies.standing(np.array([[1.0, 2.0], [2.0, 2.0]]))
    now = fitted(bodies)
    first = np.bincount(now.body)
    for _ in range(4):
        points, track_id = carried(now, bodies, sharp)
        assert (track_id < now.unused_track).sum() == pytest.approx(COUNT * 2 / 3, abs=2)
        now = Moving(points, bodies, np.ones(COUNT), track_id, int(track_id.max()) + 1)
    np.testing.assert_array_equal(np.bincount(now.body), first)


def test_gaussians_turn_with_who_lies() -> None:
    first, later = (
        Bodies(np.array([[2.0, 2.0]]), np.array([np.nan]), np.array([[way, 0.13]]))
        for way in np.radians([350.0, 10.0])
    )
    before = fitted(first)
    points, track_id = carried(before, later)
    stay = track_id < COUNT + 7
    offset, where = before.points[stay, :2] - 2.0, points[stay, :2] - 2.0
    c, s = np.cos(np.radians(20.0)), np.sin(np.radians(20.0))
    np.testing.assert_allclose(where, offset @ np.array([[c, -s], [s, c]]).T, atol=1e-9)


@pytest.mark.parametrize("lies_down", [True, False])
def test_who_lies_down_or_gets_up_is_drawn_anew(lies_down: bool) -> None:
    axes = np.array([[2.0, 2.0]])
    upright = Bodies.standing(axes)
    flat = Bodies(axes, np.array([np.nan]), np.array([[0.0, 0.13]]))
    points, track_id = carried(*((fitted(upright), flat) if lies_down else (fitted(flat), upright)))
    assert track_id.min() >= COUNT + 7
    assert (np.quantile(points[:, 2], 0.9) < 0.5) == lies_down


@pytest.mark.parametrize("sits_down", [True, False])
def test_who_sits_down_or_stands_up_is_drawn_anew_and_nobody_else(sits_down: bool) -> None:
    axes = np.array([[1.2, 2.0], [3.6, 2.0]])
    upright, seated = Bodies.standing(axes), Bodies(axes, np.array([np.nan, 0.0]))
    before = fitted(upright if sits_down else seated)
    now = seated if sits_down else upright
    points, track_id = carried(before, now)
    other = before.body == 0
    assert track_id[~other].min() >= COUNT + 7
    assert np.unique(track_id).size == COUNT
    kept = track_id < COUNT + 7
    assert kept[other].any()
    np.testing.assert_array_equal(points[kept], before.points[kept])
    # As many as before, on the body as it holds itself now: a Gaussian cloud has few points
    # further out than three and a half deviations.
    new = points[~other]
    assert (nearest_axis(new, axes) == 1).all()
    assert np.median(surface_prior(new, now.only(1))[0]) > -2.0
    assert surface_prior(new, now.only(1))[0].min() > -0.5 * 5.0**2
