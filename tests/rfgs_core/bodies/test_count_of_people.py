# SPDX-License-Identifier: Apache-2.0
"""People are counted by what most device pairs hear; noise and echoes of one pair are nobody."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lit_bodies import echoing, lit

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.count import OF_OTHERS, TO_COUNT, count_bodies, one_more_counts
from rfgs_core.bodies.gain import (
    FEWEST_PAIRS,
    NOBODY,
    Gain,
    climbed,
    gain_near,
    likelier_upright,
    stands_clear,
)
from rfgs_core.bodies.localise import BODY_RADIUS_M
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import preset
from rfgs_core.settings import TrainConfig

ROOM_M = np.array([[0.0, 0.0, 0.0], [5.0, 4.6, 2.4]])
BODIES = [(1.5, 2.9), (3.4, 1.6)]


@pytest.fixture
def empty(make_observations: Callable[..., Observations]) -> Observations:
    radio = replace(preset("wifi"), rx_rows=2, rx_cols=3, num_subcarriers=24)
    return make_observations(radio=radio, bounds_m=ROOM_M)


def upright(place: np.ndarray | tuple[float, float]) -> Bodies:
    return Bodies.standing(np.array([place]))


def noisy(observations: Observations, share: float) -> Observations:
    """With noise of a share of the mean power."""
    rng = np.random.default_rng(5)
    entries = observations.links[..., None] & observations.subcarriers
    power = np.mean(np.abs(observations.delta[entries]) ** 2)
    noise = rng.standard_normal((2, *entries.shape)) * np.sqrt(0.5 * share * (power or 1.0))
    return observations.with_delta(observations.delta + entries * (noise[0] + 1j * noise[1]))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_people_are_counted_where_they_stand(empty: Observations, count: int) -> None:
    seen = noisy(lit(empty, BODIES[:count], seed=2), 0.1)
    found = count_bodies(seen, TrainConfig(), 0)
    assert len(found) == count
    for place in BODIES[:count]:
        assert min(np.linalg.norm(one.place_xy - place) for one in found) < 0.25


@pytest.mark.parametrize(("away_m", "beside_standing", "beside_lying"),
                         [(0.3, False, False), (0.5, True, False), (1.0, True, False),
                          (1.2, True, True)])  # fmt: skip
def test_nobody_is_told_within_reach_of_who_lies(
    away_m: float, beside_standing: bool, beside_lying: bool
) -> None:
    """Hands and feet of who lies are a metre from the hips; who stands takes less room."""
    place = np.array([2.0 + away_m, 1.0])
    stands = upright((2.0, 1.0))
    lies = Bodies(stands.axes_xy, np.array([np.nan]), np.array([[0.3, 0.13]]))
    far = upright((9.0, 9.0))
    for known, clear in ((stands, beside_standing), (lies, beside_lying)):
        assert stands_clear(known, place) == clear
        assert stands_clear(Bodies.together([far, known]), place) == clear
    assert stands_clear(NOBODY, place)


def test_who_lies_is_counted_once_and_told_to_lie(empty: Observations) -> None:
    way_rad = 0.25 * np.pi
    body = Bodies(np.array([[2.6, 2.2]]), np.array([np.nan]), np.array([[way_rad, 0.13]]))
    (found,) = count_bodies(noisy(echoing(empty, body, seed=2), 0.02), TrainConfig(), 0)
    assert found.body.lies.all()
    assert np.linalg.norm(found.place_xy - body.axes_xy[0]) < 0.4
    assert abs(np.sin(found.body.ways[0, 0] - way_rad)) < 0.35


def test_who_explains_more_upright_beside_another_does_not_lie(empty: Observations) -> None:
    other = upright(BODIES[0])
    axes_xy = np.array([BODIES[1], BODIES[0]])
    lies = Bodies(np.array([BODIES[1]]) - 0.4, np.array([np.nan]), np.array([[0.8, 0.6]]))
    both = Bodies.together([lies, other])
    seen = noisy(lit(empty, BODIES, seed=2), 0.02)
    stands = likelier_upright(seen, both, axes_xy)
    assert not stands.lies.any()
    np.testing.assert_array_equal(stands.axes_xy, axes_xy)
    # Who does lie goes on lying.
    seen = noisy(echoing(empty, both, seed=2), 0.02)
    assert likelier_upright(seen, both, axes_xy) is both


def test_an_unchanged_channel_has_nobody(empty: Observations) -> None:
    assert count_bodies(empty, TrainConfig(), 0) == []


def test_too_few_device_pairs_count_nobody(empty: Observations) -> None:
    seen = lit(empty, BODIES[:1], seed=2)
    pair, _ = seen.pairs
    few = replace(seen, links=seen.links & (pair >= 0) & (pair < FEWEST_PAIRS - 1))
    assert count_bodies(few, TrainConfig(), 0) == []


def test_what_one_pair_alone_hears_is_nobody(empty: Observations) -> None:
    body = lit(empty, BODIES[:1], seed=2)
    pair, names = body.pairs
    quiet = noisy(empty.with_delta(np.zeros_like(body.delta)), 1.0).delta
    level = np.sqrt(np.mean(np.abs(body.delta[pair == 0]) ** 2))
    only = np.where((pair == 0)[..., None], body.delta, 0.1 * level * quiet)
    gain = gain_near(body.with_delta(only), NOBODY, upright(BODIES[0]))
    assert gain.nat > TO_COUNT
    assert gain.heard < 0.5
    assert not one_more_counts([gain])
    assert len(gain.by_pair) == len(names)


def test_another_place_explains_less(empty: Observations) -> None:
    seen = lit(empty, BODIES[:1], seed=2)
    here, there = (gain_near(seen, NOBODY, upright(place)) for place in BODIES)
    assert here.nat > 2.0 * there.nat


def test_who_is_known_is_not_counted_again(empty: Observations) -> None:
    seen = lit(empty, BODIES[:1], seed=2)
    first = gain_near(seen, NOBODY, upright(BODIES[0]))
    beside = gain_near(seen, upright(BODIES[0]), upright(np.add(BODIES[0], (0.45, 0.0))))
    assert not one_more_counts([first, beside])


@pytest.mark.parametrize("off_m", [(0.0, 0.0), (0.5, 0.3), (-0.4, 0.5), (-0.6, -0.4)])
def test_evidence_leads_to_a_body_from_half_a_metre_away(empty: Observations, off_m) -> None:
    seen = noisy(lit(empty, BODIES, seed=2), 0.02)
    known = upright(BODIES[0])
    begun = gain_near(seen, known, upright(np.add(BODIES[1], off_m)))
    led = climbed(seen, known, begun)
    assert led.nat >= begun.nat
    assert np.linalg.norm(led.place_xy - BODIES[1]) < 0.2


def test_evidence_does_not_lead_into_who_is_known(empty: Observations) -> None:
    seen = noisy(lit(empty, BODIES[:1], seed=2), 0.02)
    beside = upright(np.add(BODIES[0], (0.6, 0.0)))
    elsewhere = upright(BODIES[1])
    led = climbed(seen, elsewhere, gain_near(seen, elsewhere, beside))
    assert np.linalg.norm(led.place_xy - BODIES[0]) < 0.2
    into = climbed(seen, upright(BODIES[0]), gain_near(seen, upright(BODIES[0]), beside))
    assert stands_clear(upright(BODIES[0]), into.place_xy)


@pytest.mark.parametrize(
    ("rising", "beside_nobody", "beside_another"),
    [(8, False, False), (10, True, False), (11, True, True)],
)
def test_beside_nobody_fewer_pairs_are_enough(rising, beside_nobody, beside_another) -> None:
    """A pair may hear somebody who is not known yet; who is known is taken off."""
    by_pair = np.where(np.arange(14) < rising, 60.0, -2.0)
    alone = Gain(upright(BODIES[0]), by_pair, np.full(14, np.inf))
    assert one_more_counts([alone]) == beside_nobody
    last = alone._replace(expected=np.full(14, 60.0))
    assert one_more_counts([alone, last]) == beside_another


@pytest.mark.parametrize(
    ("by_pair", "expected", "counts"),
    [
        ([30.0, 30.0, 30.0, 30.0], [90.0, 90.0, 90.0, 90.0], True),
        ([30.0, 30.0, 30.0, -2.0], [90.0, 90.0, 90.0, 90.0], True),
        ([60.0, 60.0, -2.0, -2.0], [90.0, 90.0, 90.0, 90.0], False),
        ([60.0, 60.0, -2.0, -2.0], [90.0, 90.0, 1.0, 1.0], True),
        ([4.0, 4.0, 4.0, 4.0], [90.0, 90.0, 90.0, 90.0], False),
        ([60.0, 60.0, 60.0, 60.0], [1.0, 1.0, 1.0, 1.0], False),
    ],
)
def test_evidence_and_agreement_are_both_needed(
    by_pair: list[float], expected: list[float], counts: bool
) -> None:
    known = Gain(upright(np.ones(2)), np.full(4, 30.0), np.full(4, 90.0))
    one = Gain(upright(np.zeros(2)), np.array(by_pair), np.array(expected))
    assert one_more_counts([known, one]) is counts


def test_next_to_strong_evidence_a_faint_one_is_nobody() -> None:
    def of(nat: float) -> Gain:
        return Gain(upright(np.zeros(2)), np.full(4, nat / 4), np.full(4, 1e3))

    strong = 4.0 * TO_COUNT / OF_OTHERS
    assert one_more_counts([of(2.0 * TO_COUNT)])
    assert not one_more_counts([of(strong), of(strong), of(2.0 * TO_COUNT)])


@pytest.mark.parametrize("behind_m", [0.5, 1.2])
def test_evidence_does_not_lead_through_a_wall(empty: Observations, behind_m: float) -> None:
    high_x = float(ROOM_M[1, 0])
    behind = [(high_x + behind_m, 1.6)]
    seen = noisy(lit(empty, behind, seed=2), 0.1)
    best = gain_near(seen, NOBODY, upright((high_x - 0.3, 1.6)))
    assert climbed(seen, NOBODY, best).place_xy[0] <= high_x - BODY_RADIUS_M
    for found in count_bodies(seen, TrainConfig(), 0):
        assert (found.place_xy >= ROOM_M[0, :2]).all() and (found.place_xy <= ROOM_M[1, :2]).all()
