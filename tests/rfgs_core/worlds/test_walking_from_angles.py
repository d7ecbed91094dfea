# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

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
