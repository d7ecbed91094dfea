# SPDX-License-Identifier: Apache-2.0
"""How tall people are, from what a radio hears of facets on bodies of others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rfgs_core.articulated import Body, Pose, people
from rfgs_core.bodies import sizes as sizing
from rfgs_core.bodies.sizes import looks, sizes
from rfgs_core.limbs.evidence.library import about_z, upright
from rfgs_core.measure.observations import Observations
from rfgs_core.worlds.motion import random_motion

Hears = Callable[[Body, Pose], Observations]

#: Where somebody is, and how far off they are found [m].
PLACES, OFF_M = np.array([[0.3, -0.2], [-0.4, 0.5]]), np.array([0.03, -0.02])


@cache
def dressed(seed: int, *, child: bool = False) -> Body:
    """A random person in clothes."""
    return people().random(np.random.default_rng(seed), child=child)


def height_m(size: float) -> float:
    return people().body(np.array([size])).height_m


def standing(body: Body, place: np.ndarray, heading: float) -> Pose:
    return upright(body).turned(about_z(heading)).moved(np.append(place, 0.0))


def in_two_frames(heard_of: Hears, body: Body, places: np.ndarray) -> list[Observations]:
    return [
        heard_of(body, standing(body, place, heading))
        for place, heading in zip(places, (0.4, 2.1), strict=True)
    ]


@pytest.mark.parametrize(
    ("seed", "child"), [(2, True), (4, True), (3, False), (6, False), (8, False)]
)
def test_small_and_tall_people_are_told(heard_of: Hears, seed: int, child: bool) -> None:
    body = dressed(seed, child=child)
    assert abs(body.height_m - height_m(0.0)) > 0.1, "the case is too easy"
    done: list[int] = []
    found = sizes(
        in_two_frames(heard_of, body, PLACES), (PLACES + OFF_M)[:, None], lambda: done.append(1)
    )
    assert found.shape == (1, 1) and len(done) == looks(1, 2)
    off_m = abs(height_m(found[0, 0]) - body.height_m)
    assert off_m < 0.5 * abs(height_m(0.0) - body.height_m) + 0.02, (body.height_m, found)


def test_a_child_beside_an_adult(heard_of: Hears) -> None:
    child, adult = dressed(2, child=True), dressed(3)
    frames = [
        one.with_delta(one.delta + other.delta)
        for one, other in zip(
            in_two_frames(heard_of, child, PLACES),
            in_two_frames(heard_of, adult, -PLACES - 0.6),
            strict=True,
        )
    ]
    places = np.stack([PLACES, -PLACES - 0.6], axis=1)
    done: list[int] = []
    small, tall = sizes(frames, places, lambda: done.append(1))[:, 0]
    assert len(done) == looks(2, 2) == 8
    assert height_m(small) < height_m(0.0) - 0.1 and tall - small > 1.0


def test_who_is_not_upright_on_the_ground_has_no_say(heard_of: Hears) -> None:
    """Who sits is low, and who is on a step is high, but not for their size."""
    body, place = dressed(3), PLACES[0]
    motion = random_motion(np.random.default_rng(9), body, "sit")
    moments = [motion.at(t) for t in np.linspace(0.0, motion.duration_s, 20)]
    seat = min(moments, key=lambda pose: body.joints17(pose)[0, 2])
    sits = seat.moved(np.append(place - body.joints17(seat)[0, :2], 0.0))
    climbs = standing(body, place, 0.4).moved(np.array([0.0, 0.0, 0.5]))
    found = place[None, None]
    for pose in (sits, climbs):
        assert sizes([heard_of(body, pose)], found).tolist() == [[0.0]]
    upright_ = heard_of(body, standing(body, place, 0.4))
    alone = sizes([upright_], found)[0, 0]
    assert alone != 0.0
    # One frame of two is enough, one of five is not.
    low = heard_of(body, sits)
    assert sizes([upright_, low], np.repeat(found, 2, axis=0))[0, 0] == alone
    assert sizes([upright_, *[low] * 4], np.repeat(found, 5, axis=0))[0, 0] == 0.0


def test_few_device_pairs_tell_no_size(heard_of: Hears) -> None:
    body = dressed(2, child=True)
    seen = heard_of(body, standing(body, PLACES[0], 0.4))
    names = seen.pairs[1][:4]
    few = np.zeros_like(seen.links)
    for pair in names:
        few |= seen.layout.links_between(*pair) & seen.links
    done: list[int] = []
    found = sizes([replace(seen, links=few)], PLACES[:1, None], lambda: done.append(1))
    assert found.tolist() == [[0.0]] and len(done) == 1


def test_few_links_and_narrow_bands_tell_no_size(heard_of: Hears) -> None:
    body = dressed(2, child=True)
    seen = heard_of(body, standing(body, PLACES[0], 0.4))
    rows = np.zeros_like(seen.links)
    rows[:, ::2] = True
    narrow = replace(seen, freq_hz=seen.freq_hz[0] + 0.25 * (seen.freq_hz - seen.freq_hz[0]))
    for one in (replace(seen, links=seen.links & rows), narrow):
        assert sizes([one], PLACES[:1, None]).tolist() == [[0.0]]
    assert sizes([seen], PLACES[:1, None])[0, 0] < -0.5


def test_noise_tells_no_size(heard_of: Hears) -> None:
    """Of a child far below the noise nothing is said."""
    body, rng = dressed(2, child=True), np.random.default_rng(7)
    quiet = heard_of(body, standing(body, PLACES[0], 0.4))
    noise = rng.standard_normal((2, *quiet.delta.shape))
    level = np.sqrt(np.mean(np.abs(quiet.delta) ** 2))
    for loud, told in ((0.03, True), (10.0, False)):
        noisy = quiet.delta + loud * level * (noise[0] + 1j * noise[1]).astype(np.complex64)
        found = sizes([quiet.with_delta(noisy)], PLACES[:1, None])
        assert (found[0, 0] < -0.5) == told and found.any() == told


def test_a_size_is_between_those_that_are_tried() -> None:
    tried = np.arange(-3.0, 3.5)
    assert sizing._peak(-((tried - 0.3) ** 2)) == pytest.approx(0.3)
    assert np.isnan([sizing._peak(tried), sizing._peak(-tried)]).all()
