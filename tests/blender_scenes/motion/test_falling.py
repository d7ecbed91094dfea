# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from blender_scenes.motion.falling import Fall, tilt_over_time
from blender_scenes.motion.going import Stay, Turn
from blender_scenes.motion.score import Figure, Posture, compose

HERE = Posture((0.4, -0.3), 1.1)
AHEAD = {"back": np.pi, "front": 0.0, "left": np.pi / 2, "right": -np.pi / 2}


@pytest.mark.parametrize("direction", AHEAD)
def test_a_fall_ends_on_the_floor_and_never_below(figure: Figure, direction: str) -> None:
    score = compose(figure, HERE, [Fall(direction), Stay(1.0)])
    skeleton = figure.skeleton
    times = np.arange(0, score.duration_s, 0.02)
    poses = [score.pose(float(t)) for t in times]
    lowest = np.array([skeleton.touching(pose)[:, 2].min() for pose in poses])
    assert lowest.min() > -0.015
    assert lowest.max() < 0.03
    end = skeleton.joints(poses[-1])
    assert end[:, 2].max() < 0.55
    assert end[skeleton.index["head"], 2] < 0.30
    # The head lies on the side the fall went to.
    heading = HERE.heading_rad + AHEAD[direction]
    fell = end[skeleton.index["head"]] - end[skeleton.index["foot.L"]]
    assert fell[:2] @ [np.cos(heading), np.sin(heading)] > 1.0


@pytest.mark.parametrize("direction", AHEAD)
def test_a_fall_takes_as_long_as_gravity_makes_it(figure: Figure, direction: str) -> None:
    score = compose(figure, HERE, [Fall(direction)])
    skeleton = figure.skeleton
    times = np.arange(0, score.duration_s, 0.01)
    joints = np.stack([skeleton.joints(score.pose(float(t))) for t in times])
    height = joints[:, skeleton.index["head"], 2]
    high, low = height[0], height[-1]
    started = times[np.flatnonzero(height < 0.97 * high)[0]]
    landed = times[np.flatnonzero(height < low + 0.1 * (high - low))[0]]
    assert 0.4 < landed - started < 1.0
    speed = np.linalg.norm(np.diff(joints, axis=0), axis=2) / 0.01
    # Nothing is faster than the end of a rod that tips over, by more than a flung arm.
    rod = np.sqrt(3 * 9.81 * high)
    assert 2.0 < speed[:, skeleton.index["head"]].max() < rod
    assert speed.max() < 1.6 * rod


def test_tilt_keeps_the_energy_of_a_pendulum() -> None:
    tilt = tilt_over_time(1.1)
    rate = np.gradient(tilt, 0.002)
    free = slice(170, -2)
    energy = 0.5 * rate[free] ** 2 + 9.81 / 1.1 * np.cos(tilt[free])
    assert np.ptp(energy) < 0.01 * energy.mean()
    assert tilt[0] == 0 and tilt[-1] == pytest.approx(np.pi / 2)


def test_impossible_falls_are_refused(figure: Figure) -> None:
    with pytest.raises(ValueError, match="back"):
        compose(figure, HERE, [Fall("up")])
    with pytest.raises(ValueError, match="standing"):
        compose(figure, HERE, [Fall(), Turn(90)])
