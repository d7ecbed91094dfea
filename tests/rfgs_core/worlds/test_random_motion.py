# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from rfgs_core.articulated import BONES, Body, people
from rfgs_core.articulated.limits import limits
from rfgs_core.articulated.turns import vector_of
from rfgs_core.errors import RfgsError
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.motion import FAMILIES, Motion, random_motion

JointsOf = Callable[[Body, Motion, float], np.ndarray]
ON_FEET = ("walk", "stand", "gesture", "walk_gesture", "squat", "reach_high", "stairs", "crawl")
SEEDS = range(4)


def someone(seed: int) -> tuple[np.random.Generator, Body]:
    rng = np.random.default_rng(seed)
    return rng, people().random(rng, child=seed == 3)


@cache
def made(family: str, seed: int) -> tuple[Body, Motion]:
    """A motion, made once for all tests that look at it."""
    rng, body = someone(seed)
    return body, random_motion(rng, body, family)


@pytest.mark.parametrize("family", FAMILIES)
def test_one_seed_makes_one_motion(family: str) -> None:
    (_, first), (_, other) = (made(family, seed) for seed in (0, 1))
    _, again = made.__wrapped__(family, 0)
    np.testing.assert_array_equal(first.at(1.234).turns, again.at(1.234).turns)
    np.testing.assert_array_equal(first.root, again.root)
    assert np.abs(first.at(1.234).turns - other.at(1.234).turns).max() > 0.05


@pytest.mark.parametrize("family", FAMILIES)
def test_motions_are_finite_rotations_and_not_faster_than_people(
    family: str, joints_of: JointsOf
) -> None:
    for seed in SEEDS:
        body, motion = made(family, seed)
        assert 1.5 < motion.duration_s < 14.0
        places = joints_of(body, motion, 0.01)
        assert np.isfinite(places).all()
        assert np.linalg.norm(np.diff(places, axis=0), axis=2).max() / 0.01 < 12.0
        turns = motion.at(0.37 * motion.duration_s).turns
        np.testing.assert_allclose(
            turns @ np.swapaxes(turns, 1, 2), np.tile(np.eye(3), (20, 1, 1)), atol=1e-6
        )
        np.testing.assert_allclose(np.linalg.det(turns), 1.0, atol=1e-6)


@pytest.mark.parametrize("family", FAMILIES)
def test_joints_stay_within_human_limits(family: str) -> None:
    prior = limits()
    for seed in SEEDS:
        _, motion = made(family, seed)
        for local in motion.local[::15]:
            for row in range(1, len(BONES)):
                turn = np.ascontiguousarray(prior.middle[row].T @ local[row])
                vector = vector_of(turn)
                assert (vector > prior.low[row] - 0.1).all(), BONES[row]
                assert (vector < prior.high[row] + 0.1).all(), BONES[row]


def lowest_over_floor_m(body: Body, motion: Motion) -> np.ndarray:
    times = np.arange(0.0, motion.duration_s, 0.1)
    floor = np.interp(times, np.arange(len(motion.floor_m)) / 50.0, motion.floor_m)
    return np.array([body.skin(motion.at(float(t)))[:, 2].min() for t in times]) - floor


@pytest.mark.parametrize("family", FAMILIES)
def test_who_stands_touches_the_floor_and_nobody_sinks_into_it(family: str) -> None:
    for seed in SEEDS:
        gap = lowest_over_floor_m(*made(family, seed))
        assert gap.min() > -0.045
        if family in ON_FEET:
            assert gap.min() > -0.03 and gap.max() < 0.03
        elif family != "exercise":
            assert gap.max() < 0.06


def test_families_differ() -> None:
    """Heights of head and wrists over time tell families apart."""
    seen = {}
    for family in FAMILIES:
        rows = []
        for seed in SEEDS:
            body, motion = made(family, seed)
            times = np.linspace(0.0, motion.duration_s, 30)
            places = np.stack([body.joints17(motion.at(float(t))) for t in times])
            heights = places[:, [JOINTS.index(n) for n in ("head", "pelvis", "left_wrist")], 2]
            travel = np.linalg.norm(places[-1, 0, :2] - places[0, 0, :2])
            rows.append([*(heights / body.height_m).mean(axis=0), heights.std(), travel])
        seen[family] = np.mean(rows, axis=0)
    names = list(seen)
    apart = [np.abs(seen[a] - seen[b]).max() for i, a in enumerate(names) for b in names[:i]]
    assert min(apart) > 0.01
    assert seen["lie"][0] < 0.5 < 0.8 < seen["stand"][0]
    assert seen["sit"][1] < seen["stand"][1] - 0.05
    assert seen["reach_high"][2] > seen["stand"][2]
    assert seen["walk"][4] > 1.0 > seen["stand"][4]


def test_who_falls_lies_at_the_end(joints_of: JointsOf) -> None:
    for seed in SEEDS:
        body, motion = made("fall", seed)
        head = joints_of(body, motion, 0.02)[:, JOINTS.index("head"), 2]
        assert head[0] > 0.8 * body.height_m
        assert head[-1] < 0.35 * body.height_m
        falling = (head < 0.8 * body.height_m) & (head > 0.3 * body.height_m)
        assert falling.sum() * 0.02 < 1.2


def test_stairs_lead_up_or_down() -> None:
    climbs = np.array([np.ptp(made("stairs", seed)[1].root[:, 2]) for seed in range(6)])
    assert (climbs > 0.4).all()
    ends = [made("stairs", seed)[1].root[-1, 2] - 0.9 for seed in range(6)]
    assert min(ends) < -0.3 < 0.3 < max(ends)


def test_seats_are_as_high_as_seats(person: Body) -> None:
    from rfgs_core.worlds.motion.sitting import seat_below_m

    below = seat_below_m(person)
    assert 0.03 < below < 0.2
    for seed in range(6):
        motion = random_motion(np.random.default_rng(seed), person, "sit")
        seat = motion.root[:, 2].min() - below
        assert 0.3 < seat < 0.58


def test_poses_between_samples_lie_between_them(person: Body) -> None:
    motion = random_motion(np.random.default_rng(2), person, "walk")
    for time_s in (0.5, 1.11, 2.0):
        before, at, after = (motion.at(time_s + d).root for d in (-0.01, 0.0, 0.01))
        np.testing.assert_allclose(at, 0.5 * (before + after), atol=2e-3)
    np.testing.assert_array_equal(motion.at(-5.0).root, motion.at(0.0).root)
    np.testing.assert_array_equal(motion.at(1e6).root, motion.at(motion.duration_s).root)


def test_an_unknown_family_is_refused(person: Body) -> None:
    with pytest.raises(RfgsError, match="no family of motions 'swim'"):
        random_motion(np.random.default_rng(0), person, "swim")


def test_motions_need_neither_torch_nor_blender() -> None:
    code = (
        "import sys, numpy as np; from rfgs_core.articulated import people;"
        "from rfgs_core.worlds.motion import random_motion;"
        "random_motion(np.random.default_rng(0), people().body(np.zeros(1)), 'walk');"
        "assert not {'bpy', 'anny', 'torch'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
