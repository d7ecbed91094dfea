# SPDX-License-Identifier: Apache-2.0
"""Upright bodies are found although every device sees only its own side of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lit_bodies import lit

from rfgs_core.bodies.localise import (
    BODY_RADIUS_M,
    GROUND_STEP_M,
    PEAK_RADIUS_M,
    SEPARATION_M,
    PairMaps,
    _separate_peaks,
    locate_bodies,
    pair_maps,
)
from rfgs_core.radio import preset

ROOM_M = np.array([[0.0, 0.0, 0.0], [3.6, 3.2, 2.2]])


@pytest.fixture(scope="module")
def _cache() -> dict:
    return {}


@pytest.fixture
def maps_of(make_observations, _cache: dict) -> Callable[..., PairMaps]:
    """Maps of bodies at given places, kept between the tests of this module."""

    def make(*bodies: tuple[float, float]) -> PairMaps:
        if bodies not in _cache:
            radio = replace(preset("mmwave"), freq_max_hz=62e9, num_subcarriers=160)
            radio = replace(radio, tx_rows=4)
            observations = make_observations(radio=radio, bounds_m=ROOM_M)
            _cache[bodies] = pair_maps(lit(observations, list(bodies), seed=len(bodies)))
        return _cache[bodies]

    return make


def test_one_body_is_found_at_its_axis(maps_of) -> None:
    for body in ((2.1, 1.3), (1.3, 2.0)):
        found = locate_bodies(maps_of(body), ROOM_M)
        assert found.shape == (1, 2)
        assert np.linalg.norm(found[0] - body) < 0.06


def test_two_bodies_are_found(maps_of) -> None:
    bodies = np.array([(1.0, 1.1), (2.5, 2.1)])
    found = locate_bodies(maps_of(*map(tuple, bodies.tolist())), ROOM_M, count=2)
    order = np.linalg.norm(found[:, None] - bodies, axis=2).argmin(axis=1)
    assert sorted(order.tolist()) == [0, 1]
    assert np.linalg.norm(found - bodies[order], axis=1).max() < 0.06


def test_what_is_expected_restricts_the_search_and_tells_bodies_apart(maps_of) -> None:
    """Each body is the one near its expected place, in the same order."""
    bodies = ((1.0, 1.1), (2.5, 2.1))
    maps = maps_of(*bodies)
    for order in ([0, 1], [1, 0]):
        near = np.array(bodies)[order] + np.array([0.15, -0.2])
        found = locate_bodies(maps, ROOM_M, count=2, near=near)
        assert np.linalg.norm(found - np.array(bodies)[order], axis=1).max() < 0.06
    # With a reach that holds both, the first does not take the place of the second.
    for order in ([0, 1], [1, 0]):
        near = np.array(bodies)[order] + np.array([0.3, 0.3])
        found = locate_bodies(maps, ROOM_M, 2, near, reach_m=np.array([3.0, 3.0]))
        assert np.linalg.norm(found - np.array(bodies)[order], axis=1).max() < 0.06
    # Far from both the answer stays within the reach, though nothing is there.
    corner = np.array([[3.4, 0.2]])
    found = locate_bodies(maps, ROOM_M, count=1, near=corner)
    assert np.linalg.norm(found - corner) <= 0.8 + 1e-9
    # Expected outside of the room, a body is taken to stand at its edge.
    outside = np.array([[9.0, 1.5]])
    found = locate_bodies(maps, ROOM_M, count=1, near=outside, reach_m=np.array([0.5]))
    assert found[0, 0] > ROOM_M[1, 0] - BODY_RADIUS_M - GROUND_STEP_M - 1e-9


def test_bodies_do_not_stand_in_walls_or_in_each_other(maps_of) -> None:
    found = locate_bodies(maps_of((2.1, 1.3)), ROOM_M, count=3)
    assert (found >= BODY_RADIUS_M - 1e-9).all()
    assert (found <= ROOM_M[1, :2] - BODY_RADIUS_M + 1e-9).all()
    apart = np.linalg.norm(found[:, None] - found, axis=2)
    assert apart[np.triu_indices(3, 1)].min() >= 0.4


def test_reading_a_column_is_the_mean_of_reading_its_points(maps_of) -> None:
    """Also above the uppermost grid point, where the border value continues."""
    maps = maps_of((2.1, 1.3))
    places = np.random.default_rng(0).uniform(-0.2, 3.4, (40, 2))
    heights_m = np.array([-0.3, 0.02, 0.9, 1.234, 2.15, 2.9])
    points = np.concatenate([np.column_stack([places, np.full(len(places), z)]) for z in heights_m])
    plain = maps.at(points).reshape(len(maps.power), len(heights_m), -1).mean(axis=1)
    np.testing.assert_allclose(maps.upright(places, heights_m), plain, rtol=1e-5)


def test_a_body_is_found_where_the_loudest_column_stands_elsewhere(maps_of) -> None:
    """One pair may hear a thing louder than all pairs together hear the body."""
    maps = maps_of((2.1, 1.3))
    power = maps.power.copy()
    ghost = np.round((np.array([0.8, 2.4]) - maps.origin_m[:2]) / maps.spacing_m).astype(int)
    power[0, ghost[0] - 2 : ghost[0] + 3, ghost[1] - 2 : ghost[1] + 3] += 40 * power[0].max()
    found = locate_bodies(replace(maps, power=power), ROOM_M)
    assert np.linalg.norm(found[0] - [2.1, 1.3]) < 0.06


def test_maps_have_mean_one_and_read_between_grid_points(maps_of) -> None:
    maps = maps_of((2.1, 1.3))
    np.testing.assert_allclose(maps.power.mean(axis=(1, 2, 3)), 1.0, rtol=1e-3)
    assert len(maps.power) == len(maps.tx_xyz) == len(maps.rx_xyz) == 4
    low, high = maps.power[:, 10, 20, 5], maps.power[:, 11, 20, 5]
    place = maps.origin_m + maps.spacing_m * np.array([10.25, 20, 5])
    got = maps.at(np.array([place, maps.origin_m - 5.0]))
    np.testing.assert_allclose(got[:, 0], 0.75 * low + 0.25 * high, rtol=1e-4)
    np.testing.assert_allclose(got[:, 1], maps.power[:, 0, 0, 0], rtol=1e-5)


def test_the_grid_follows_the_finer_of_range_and_room(make_observations) -> None:
    """Half the range resolution, but between 4 and 12 cm."""
    bounds_m = np.array([[0.0, 0.0, 0.0], [1.2, 1.2, 1.2]])
    coarse = pair_maps(make_observations(bounds_m=bounds_m, inset_m=0.1, heights_m=(0.5,)))
    assert coarse.spacing_m == pytest.approx(0.12)
    assert coarse.power.shape == (16, 10, 10, 10)
    np.testing.assert_allclose(coarse.origin_m, 0.06)


def test_a_weak_body_is_not_lost_to_the_slope_of_a_strong_one() -> None:
    axis = np.arange(0.0, 3.0, 0.04)
    ground = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    strong, weak = np.array([0.8, 0.8]), np.array([2.2, 2.0])
    apart = [np.linalg.norm(ground - body, axis=1) for body in (strong, weak)]
    score = 4.0 * np.exp(-((apart[0] / 0.9) ** 2)) + np.exp(-((apart[1] / 0.3) ** 2))
    # Half a metre away the strong one still scores three times as much as the weak one.
    assert 4.0 * np.exp(-((0.5 / 0.9) ** 2)) > 2.5
    found = ground[_separate_peaks(ground, score, 2)]
    assert np.linalg.norm(found - [strong, weak], axis=1).max() < 0.05
    assert len(np.unique(_separate_peaks(ground, score, 4))) == 4


def test_peaks_are_those_of_asking_every_place() -> None:
    rng = np.random.default_rng(3)
    axes = [np.arange(0.0, side, GROUND_STEP_M) for side in (2.0, 1.2)]
    ground = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance_m = np.linalg.norm(ground[:, None] - ground, axis=2)
    for digits in (9, 1):
        waves = np.sin(3.0 * ground @ rng.standard_normal((2, 5))).sum(axis=1)
        # Rounded scores are equal in many places: the first of them is taken.
        score = np.round(waves + 0.1 * rng.standard_normal(len(ground)), digits)
        peak = score >= np.where(distance_m <= PEAK_RADIUS_M, score, -np.inf).max(axis=1)
        free, expected = np.ones(len(ground), dtype=bool), []
        # More than there are peaks, so that slopes are taken too.
        for _ in range(9):
            among = free & peak if (free & peak).any() else free
            expected.append(int(np.where(among, score, -np.inf).argmax()))
            free &= distance_m[expected[-1]] >= SEPARATION_M
        assert not (free & peak).any() and not peak[expected].all()
        assert _separate_peaks(ground, score, 9).tolist() == expected
