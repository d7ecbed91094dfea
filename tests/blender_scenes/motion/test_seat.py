# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from blender_scenes.motion.going import Stay
from blender_scenes.motion.score import Figure, Posture, Score, compose
from blender_scenes.motion.seat import Rise, Sit, before_seat, seat_contact_m

HERE = Posture((0.4, -0.3), 2.0)
#: Thigh and shank are taken at their upper thirds, bones of the rig, feet at the ankle.
_LEG_MASS = {"upperleg02": 0.10, "lowerleg02": 0.045, "foot": 0.015}
Follow = Callable[[Score, float], np.ndarray]


@pytest.mark.parametrize("seat_m", [0.38, 0.45, 0.52])
def test_body_rests_on_the_seat_and_feet_stay(
    figure: Figure, joints_over: Follow, seat_m: float
) -> None:
    score = compose(figure, HERE, [Sit(seat_m), Stay(1.0), Rise(seat_m)])
    skeleton = figure.skeleton
    held = score.parts[0].end.pose(figure)
    assert seat_contact_m(figure, held) == pytest.approx(seat_m - 0.01, abs=0.002)
    joints = joints_over(score, 0.05)
    for side in "LR":
        for bone in ("foot", "toe1-1"):
            track = joints[:, skeleton.index[f"{bone}.{side}"]]
            assert np.ptp(track, axis=0).max() < 1e-9
    speed = np.linalg.norm(np.diff(joints, axis=0), axis=2) / 0.05
    assert speed.max() < 2.5
    assert joints[-1] == pytest.approx(joints[0], abs=1e-6)


def test_trunk_leans_forward_for_balance(figure: Figure, joints_over: Follow) -> None:
    skeleton = figure.skeleton
    joints = joints_over(compose(figure, HERE, [Sit(0.45)]), 0.02)
    trunk = joints[:, skeleton.index["neck01"]] - joints[:, skeleton.index["root"]]
    lean = np.degrees(np.arctan2(trunk @ HERE.ahead, trunk[:, 2]))
    assert 25 < lean.max() < 55
    # While the buttocks are in the air, the weight stays over the feet (mass shares: Winter).
    shares = {"spine02": 0.50, "head": 0.08, "spine01": 0.10}
    shares |= {f"{name}.{side}": mass for side in "LR" for name, mass in _LEG_MASS.items()}
    mass = sum(share * joints[:, skeleton.index[name]] for name, share in shares.items())
    mass = mass / sum(shares.values())
    heights = joints[:, skeleton.index["root"], 2]
    ahead = (mass[:, :2] - HERE.place_m) @ HERE.ahead[:2]
    airborne = heights > heights[-1] + 0.1
    assert ahead[airborne].min() > -0.10 and ahead.max() < 0.15


def test_hands_come_to_lie_on_the_thighs(figure: Figure) -> None:
    held = compose(figure, HERE, [Sit(0.45)]).end.pose(figure)
    skeleton = figure.skeleton
    joints = skeleton.joints(held)
    for side in "LR":
        hip, knee, wrist = (
            joints[skeleton.index[f"{n}.{side}"]] for n in ("upperleg01", "lowerleg01", "wrist")
        )
        along = (wrist - hip) @ (knee - hip) / ((knee - hip) @ (knee - hip))
        above = wrist - hip - along * (knee - hip)
        assert 0.4 < along < 0.8
        assert 0.06 < above[2] < 0.14


def test_pelvis_comes_over_the_seat_that_was_meant(figure: Figure) -> None:
    start = before_seat(figure, (1.5, -0.7), 0.9, 0.42)
    held = compose(figure, start, [Sit(0.42)]).end.pose(figure)
    assert held.root[:2] == pytest.approx([1.5, -0.7], abs=1e-9)
    assert start.heading_rad == 0.9


def test_only_who_sits_can_rise(figure: Figure) -> None:
    with pytest.raises(ValueError, match="sitting"):
        compose(figure, HERE, [Rise()])
    with pytest.raises(ValueError, match="standing"):
        compose(figure, HERE, [Sit(), Sit()])
