# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.articulated import Body, people
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.motion import gait
from rfgs_core.worlds.motion.contact import soles
from rfgs_core.worlds.motion.gait import Gait, curve, swing_for
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.track import SIDES, Track


def walking(body: Body, how: Gait, duration_s: float = 4.0) -> Track:
    """Walks straight on and does nothing else."""
    track = Track(body, duration_s)
    phase = track.times / how.stride_s
    gait.set_legs(track, how, phase, swing_for(body, how), np.ones(len(phase)))
    track.root[:, :2] = gait.travel(track, how, phase)
    track.ground()
    return track


@pytest.mark.parametrize("speed_m_s", [0.4, 0.8, 1.2, 1.6])
def test_mean_speed_is_as_asked(person: Body, speed_m_s: float) -> None:
    how = gait.random_gait(np.random.default_rng(1), person, speed_m_s)
    track = walking(person, how)
    strides = int(4.0 / how.stride_s)
    last = round(strides * how.stride_s * RATE_HZ)
    mean = (track.root[last] - track.root[0]) / (last / RATE_HZ)
    assert mean[0] == pytest.approx(speed_m_s, rel=0.06)
    assert abs(mean[1]) < 0.1 * speed_m_s


@pytest.mark.parametrize("speed_m_s", [0.4, 0.8, 1.2, 1.6])
def test_a_foot_that_bears_stays_where_it_is(person: Body, speed_m_s: float) -> None:
    how = gait.random_gait(np.random.default_rng(2), person, speed_m_s)
    track = walking(person, how)
    world = track.world()
    heads = track.heads(world)
    for side, late in (("left", 0.0), ("right", 0.5 - how.limp)):
        points = soles(track, side, world, heads)
        speed = np.linalg.norm(np.diff(points, axis=0), axis=2) * RATE_HZ
        phase = ((track.times / how.stride_s + late) % 1.0)[:-1]
        # Single support: the other foot is in the air.
        alone = (phase > 0.14) & (phase < 0.44)
        assert speed.min(axis=1)[alone].max() < 0.5
        assert points[:-1][alone][:, :, 2].min(axis=1).max() < 0.03


@pytest.mark.parametrize("speed_m_s", [0.6, 1.0, 1.4])
def test_the_sole_lies_flat_in_mid_stance_and_both_feet_touch_in_double_support(
    person: Body, speed_m_s: float
) -> None:
    """Perry and Burnfield, Gait Analysis (2010): foot flat from 12 % to 31 % of the stride."""
    how = replace(gait.random_gait(np.random.default_rng(2), person, speed_m_s), limp=0.0)
    track = walking(person, how)
    world = track.world()
    heads = track.heads(world)
    phase = (track.times / how.stride_s) % 1.0
    for side, late in (("left", 0.0), ("right", 0.5)):
        height = soles(track, side, world, heads)[:, :, 2]
        own = (phase + late) % 1.0
        flat = (own > 0.13) & (own < 0.30)
        assert height[flat].max() < 0.012
        assert np.ptp(height[flat], axis=1).max() < 0.01
        both = (own > 0.05) & (own < 0.10)
        assert height[both].min(axis=1).max() < 0.025


@pytest.mark.parametrize("speed_m_s", [0.8, 1.0, 1.3])
def test_the_pelvis_is_lower_than_in_standing_and_lowest_in_double_support(
    person: Body, speed_m_s: float
) -> None:
    """It rises and falls by 2 to 5 cm twice a stride and does not reach the height of somebody
    who stands (Saunders, Inman and Eberhart, J. Bone Joint Surg. 35-A(3), 1953)."""
    how = replace(gait.random_gait(np.random.default_rng(2), person, speed_m_s), limp=0.0)
    track = walking(person, how)
    standing = Track(person, 0.1)
    standing.ground()
    drop = standing.root[0, 2] - track.root[:, 2]
    assert 0.0 < drop.min() < 0.02
    assert 0.01 < drop.mean() < 0.05
    assert 0.012 < np.ptp(drop) < 0.06
    # Steps follow each other twice a stride; both feet bear until 10 % of it.
    double = np.cos(2.0 * np.pi * (2.0 * track.times / how.stride_s - 0.1))
    assert np.corrcoef(double, drop)[0, 1] > 0.7


def test_curves_pass_through_what_was_read_off() -> None:
    at = np.arange(20) / 20.0
    for table in (gait._HIP, gait._KNEE, gait._ANKLE):
        assert np.degrees(curve(table, at)) == pytest.approx(table, abs=2.5)
        assert curve(table, at + 3.0) == pytest.approx(curve(table, at))
    knee = np.degrees(curve(gait._KNEE, np.linspace(0, 1, 200)))
    assert knee.min() > 0.0 and 58 < knee.max() < 68, "knees bend one way"


def test_children_take_shorter_steps() -> None:
    rng = np.random.default_rng
    grown, child = people().random(rng(1)), people().random(rng(1), child=True)
    longer, shorter = (gait.random_gait(rng(0), body, 1.0).stride_s for body in (grown, child))
    assert shorter < longer


def test_arms_swing_against_legs(person: Body) -> None:
    how = gait.random_gait(np.random.default_rng(0), person, 1.2)
    track = walking(person, how)
    wave = 2.0 * np.pi * track.times / how.stride_s
    for side in SIDES:
        gait._swing_arm(np.random.default_rng(0), track, side, wave, np.full(len(wave), 0.5))
    motion = track.motion("walk")
    joints = np.stack([person.joints17(motion.at(float(t))) for t in np.arange(0, 4, 0.05)])
    for wrist, ankle in (("left_wrist", "left_ankle"), ("right_wrist", "right_ankle")):
        ahead = [joints[:, JOINTS.index(name), 0] - joints[:, 0, 0] for name in (wrist, ankle)]
        assert np.ptp(ahead[0]) > 0.3
        assert np.corrcoef(*ahead)[0, 1] < -0.7
