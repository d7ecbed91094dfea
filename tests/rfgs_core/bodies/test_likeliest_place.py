# SPDX-License-Identifier: Apache-2.0
"""Places are found in spite of echoes off walls, which draw the peaks of maps aside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lit_bodies import echoing, lit

from rfgs_core.bodies import likeliest_place as settling
from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.likeliest_place import FEWEST_PAIRS, likeliest_peak, likeliest_places
from rfgs_core.bodies.localise import (
    BODY_RADIUS_M,
    SEPARATION_M,
    locate_bodies,
    pair_maps,
)
from rfgs_core.fit.frame import start_frame
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import preset
from rfgs_core.settings import TrainConfig

ROOM_M = np.array([[0.0, 0.0, 0.0], [5.0, 4.6, 2.4]])
ALONE = [(1.4, 2.9), (3.5, 1.3), (2.4, 2.2), (3.8, 3.3)]
#: Share of an amplitude that a wall reflects.
REFLECTED = 0.6


@pytest.fixture
def empty(make_observations: Callable[..., Observations]) -> Observations:
    radio = replace(preset("wifi"), rx_rows=2, rx_cols=2, num_subcarriers=24)
    return make_observations(radio=radio, bounds_m=ROOM_M)


def in_a_room(empty: Observations, bodies: list[tuple[float, float]], seed: int) -> Observations:
    """Scatterers heard straight, and with the antennas of either end in the mirror of each wall."""
    delta = lit(empty, bodies, seed).delta
    for axis in range(3):
        for at_m in ROOM_M[:, axis]:
            for end in ("tx_xyz", "rx_xyz"):
                image = getattr(empty.layout, end).copy()
                image[:, axis] = 2.0 * at_m - image[:, axis]
                behind = replace(empty, layout=replace(empty.layout, **{end: image}))
                delta = delta + REFLECTED * lit(behind, bodies, seed).delta
    return empty.with_delta(delta)


def moved(seen: Observations, places: np.ndarray) -> np.ndarray:
    return likeliest_places(seen, Bodies.standing(places), places).axes_xy


def off_m(places: np.ndarray, bodies: list[tuple[float, float]]) -> np.ndarray:
    return np.linalg.norm(places - np.array(bodies), axis=1)


def test_echoes_off_walls_draw_nobody_aside(empty: Observations) -> None:
    by_map, by_evidence = [], []
    for seed, body in enumerate(ALONE):
        seen = in_a_room(empty, [body], seed)
        found = locate_bodies(pair_maps(seen), seen.bounds_m, 1)
        by_map += off_m(found, [body]).tolist()
        by_evidence += off_m(moved(seen, found), [body]).tolist()
    assert np.mean(by_map) > 0.15, "the case is too easy"
    assert np.mean(by_evidence) < 0.5 * np.mean(by_map), by_evidence


@pytest.fixture
def three_radars(make_observations: Callable[..., Observations]) -> Observations:
    radio = replace(preset("mmwave"), rx_cols=4, num_subcarriers=32)
    whole = make_observations(radio=radio, bounds_m=ROOM_M)
    return replace(whole, links=whole.links & (whole.pairs[0] < 3))


def with_ghost(
    empty: Observations, body: tuple[float, float], ghost: tuple[float, float], seed: int
) -> Observations:
    """A body, and somewhere else what looks like one, louder, to all radars but the last."""
    pair, _ = empty.pairs
    louder = 2.0 * np.where((pair < 2)[..., None], lit(empty, [ghost], seed + 50).delta, 0.0)
    return empty.with_delta(lit(empty, [body], seed).delta + louder)


def test_of_several_peaks_the_likeliest_is_taken(three_radars: Observations) -> None:
    by_map, by_evidence = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        high = ROOM_M[1, :2] - 0.6
        body, ghost = (tuple(rng.uniform([0.6, 0.6], high).tolist()) for _ in range(2))
        seen = with_ghost(three_radars, body, ghost, seed)
        maps = pair_maps(seen)
        by_map += off_m(locate_bodies(maps, ROOM_M, 1), [body]).tolist()
        by_evidence += off_m(likeliest_peak(seen, maps), [body]).tolist()
    right, now_right = np.array(by_map) < 0.15, np.array(by_evidence) < 0.15
    assert 2 <= right.sum() <= 3, "the case is too easy, or hopeless"
    assert now_right[right].all()
    assert now_right.sum() >= right.sum() + 2, by_evidence


def test_only_peaks_where_somebody_is_expected_are_asked(three_radars: Observations) -> None:
    body, ghost = (1.4, 2.9), (3.5, 1.3)
    seen = with_ghost(three_radars, body, ghost, seed=1)
    maps, reach_m = pair_maps(seen), np.array([0.6])
    at_body, at_ghost = (
        likeliest_peak(seen, maps, np.array([here]), reach_m) for here in (body, ghost)
    )
    assert off_m(at_body, [body])[0] < 0.15
    assert off_m(at_ghost, [ghost])[0] <= 0.6


def test_without_phases_or_with_two_pairs_the_highest_peak_is_taken(
    three_radars: Observations,
) -> None:
    # The case above in which the map is wrong and evidence is not.
    seen = with_ghost(three_radars, (2.54, 3.83), (1.15, 3.83), seed=1)
    maps, (pair, _) = pair_maps(seen), seen.pairs
    assert off_m(likeliest_peak(seen, maps), [(2.54, 3.83)])[0] < 0.15
    two = replace(seen, links=seen.links & (pair < 2))
    without_phases = replace(seen, kind="delay_power")
    for left, shown in ((two, pair_maps(two)), (without_phases, maps)):
        highest = locate_bodies(shown, ROOM_M, 1)
        assert off_m(highest, [(2.54, 3.83)])[0] > 1.0
        np.testing.assert_array_equal(likeliest_peak(left, shown), highest)


def test_several_people_are_each_placed_beside_the_others(empty: Observations) -> None:
    bodies = [ALONE[0], ALONE[1]]
    seen = in_a_room(empty, bodies, seed=3)
    guessed = np.array(bodies) + np.array([[0.2, -0.1], [-0.15, 0.2]])
    found = moved(seen, guessed)
    assert off_m(found, bodies).max() < 0.15


def test_people_stay_apart_and_in_the_room(empty: Observations) -> None:
    corner = (ROOM_M[0, 0] + BODY_RADIUS_M, ROOM_M[0, 1] + BODY_RADIUS_M)
    seen = in_a_room(empty, [corner], seed=4)
    guessed = np.array([corner, (corner[0] + SEPARATION_M + 0.05, corner[1])]) + 0.1
    found = moved(seen, guessed)
    assert np.linalg.norm(found[1] - found[0]) >= SEPARATION_M - 1e-9
    assert (found >= ROOM_M[0, :2] + BODY_RADIUS_M - 1e-9).all()
    assert (found <= ROOM_M[1, :2] - BODY_RADIUS_M + 1e-9).all()


def test_without_phases_or_with_few_pairs_places_stay(empty: Observations) -> None:
    seen = in_a_room(empty, ALONE[:1], seed=0)
    guessed = np.array(ALONE[:1]) + 0.2
    pair, _ = seen.pairs
    few = replace(seen, links=seen.links & (pair >= 0) & (pair < FEWEST_PAIRS - 1))
    silent = seen.with_delta(np.where((pair < FEWEST_PAIRS - 1)[..., None], seen.delta, 0))
    for left in (few, silent, replace(seen, kind="delay_power")):
        np.testing.assert_array_equal(moved(left, guessed), guessed)
    assert (moved(seen, guessed) != guessed).any()


def test_a_body_ends_where_no_place_around_is_likelier(empty: Observations) -> None:
    seen, guessed = in_a_room(empty, ALONE[:1], seed=0), np.array(ALONE[:1]) + 0.2
    found = moved(seen, guessed)
    # Entries are steered to where the body was guessed, as when it was moved.
    evidence = settling._PlaceEvidence(seen, guessed[0], [])
    here = evidence.at(found[0])
    assert here > evidence.at(guessed[0])
    for angle in np.arange(8) * 0.25 * np.pi:
        step_m = settling._LAST_STEP_M * np.sign(np.round([np.cos(angle), np.sin(angle)], 3))
        assert evidence.at(found[0] + step_m) <= here
    # From there it is moved no further, though entries are steered to another place.
    assert np.linalg.norm(moved(seen, found) - found) < 2.0 * settling._LAST_STEP_M


def test_a_frame_is_settled_unless_asked_not_to(empty: Observations) -> None:
    seen, config = in_a_room(empty, ALONE[:1], seed=0), TrainConfig(num_gaussians=300)
    by_map = locate_bodies(pair_maps(seen), seen.bounds_m, 1)

    def placed(settle: bool) -> np.ndarray:
        return start_frame(seen, config, 0, None, settle=settle).tracks.bodies.axes_xy

    np.testing.assert_array_equal(placed(False), by_map)
    settled = placed(True)
    np.testing.assert_array_equal(settled, moved(seen, by_map))
    assert off_m(settled, ALONE[:1])[0] < off_m(by_map, ALONE[:1])[0]


def test_nobody_is_left_nobody(empty: Observations) -> None:
    assert len(moved(in_a_room(empty, ALONE[:1], seed=0), np.zeros((0, 2)))) == 0


@pytest.mark.parametrize("lies", [True, False])
def test_who_is_said_to_lie_does_if_that_explains_more(empty: Observations, lies: bool) -> None:
    stands, other = np.array(ALONE[0]), np.array(ALONE[1])
    unknown = np.full(2, np.nan)
    way = np.array([[np.nan, np.nan], [0.4, 0.13]])
    both = Bodies(np.array([stands, other]), unknown, way)
    truly = both if lies else Bodies.standing(both.axes_xy)
    seen = echoing(empty, truly, seed=2)
    found = likeliest_places(seen, both, both.axes_xy + np.array([[0.0, 0.0], [0.1, 0.1]]))
    np.testing.assert_array_equal(found.lies, [False, lies])
    assert np.linalg.norm(found.axes_xy - truly.axes_xy, axis=1).max() < 0.15
    if lies:
        np.testing.assert_array_equal(found.ways[1], way[1])
