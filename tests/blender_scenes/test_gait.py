# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from blender_scenes.gait import Gait, Legs, feet_at, pelvis_at, solve_leg
from blender_scenes.rotations import about, about_x, about_y, about_z, frame_between
from blender_scenes.walk_path import ArcPath

PATH = ArcPath((0.2, -0.1), 0.3, 4.0, -0.8)


def mirrored(x: float, y: float, z: float) -> np.ndarray:
    return np.array([[x, y, z], [-x, y, z]])


@pytest.fixture
def legs() -> Legs:
    return Legs(
        root=np.array([0.0, 0.0, 0.905]),
        hip=mirrored(0.113, 0.007, 0.90),
        knee=mirrored(0.145, -0.03, 0.49),
        ankle=mirrored(0.19, -0.005, 0.075),
        toe=mirrored(0.17, -0.155, 0.032),
        heel=mirrored(0.19, 0.045, 0.0),
    )


def test_arc_has_its_length_and_turns_by_its_angle() -> None:
    s = np.linspace(0, PATH.length_m, 2001)
    points = PATH.position(s)
    steps = np.diff(points, axis=0)
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(4.0, rel=1e-5)
    assert PATH.heading(4.0) - PATH.heading(0.0) == pytest.approx(-0.8)
    assert PATH.position(2.0) == pytest.approx([0.2, -0.1])
    measured = np.arctan2(steps[:, 1], steps[:, 0])
    assert np.abs(measured - PATH.heading(0.5 * (s[1:] + s[:-1]))).max() < 1e-4


def test_planted_feet_stand_still(legs: Legs) -> None:
    gait = Gait()
    times = np.arange(0.0, 6.0, 0.02)
    feet = [feet_at(gait, legs, PATH, t) for t in times]
    ankle = np.array([f.ankle for f in feet])
    both = np.array([f.planted for f in feet])
    both = both[1:] & both[:-1]
    assert both.mean() > 0.2
    moved = np.linalg.norm(np.diff(ankle, axis=0), axis=2)
    assert moved[both].max() < 1e-9
    # While the heel rises the toes stay where they are.
    toe = np.array([f.ankle + np.einsum("sij,sj->si", f.foot, legs.toe - legs.ankle) for f in feet])
    share = np.array([[(gait.phase(t) - 0.5 * side) % 1 for side in (0, 1)] for t in times])
    rolling = (share > gait.flat_from + 0.01) & (share < gait.stance - 0.02)
    rolling = rolling[1:] & rolling[:-1]
    assert np.linalg.norm(np.diff(toe, axis=0), axis=2)[rolling].max() < 1e-9


def test_feet_never_jump(legs: Legs) -> None:
    times = np.arange(0.0, 6.0, 0.002)
    ankle = np.array([feet_at(Gait(), legs, PATH, t).ankle for t in times])
    speed = np.linalg.norm(np.diff(ankle, axis=0), axis=2) / 0.002
    assert speed.max() < 3.0
    assert ankle[..., 2].min() > legs.ankle[0, 2] - 0.01


def test_legs_reach_every_footprint_without_stretching(legs: Legs) -> None:
    for time_s in np.arange(0.0, 6.0, 0.05):
        feet = feet_at(Gait(), legs, PATH, time_s)
        root, pelvis = pelvis_at(Gait(), legs, PATH, time_s)
        for side in (0, 1):
            thigh, shin, stretch = solve_leg(legs, side, root, pelvis, feet)
            assert stretch < 1.0
            hip = root + pelvis @ (legs.hip[side] - legs.root)
            knee = hip + thigh @ (legs.knee[side] - legs.hip[side])
            ankle = knee + shin @ (legs.ankle[side] - legs.knee[side])
            assert ankle == pytest.approx(feet.ankle[side], abs=1e-9)
            forward = -(pelvis[:, 1])
            # A knee bends forwards: it lies ahead of the line from hip to ankle.
            assert (knee - 0.5 * (hip + ankle)) @ forward > -0.01


def test_a_leg_that_cannot_reach_says_so(legs: Legs) -> None:
    far = dataclasses.replace(Gait(), step_m=1.4)
    stretches = []
    for time_s in np.arange(0.0, 3.0, 0.1):
        root, pelvis = pelvis_at(far, legs, PATH, time_s)
        stretches.append(solve_leg(legs, 0, root, pelvis, feet_at(far, legs, PATH, time_s))[2])
    assert max(stretches) > 1.0


def test_pelvis_follows_the_path_at_walking_speed(legs: Legs) -> None:
    gait = Gait()
    for time_s in (1.0, 2.5, 4.0):
        root, pelvis = pelvis_at(gait, legs, PATH, time_s)
        s = gait.travelled(time_s)
        assert np.linalg.norm(root[:2] - PATH.position(s)) <= gait.sway_m + 1e-9
        heading = np.arctan2(-pelvis[1, 1], -pelvis[0, 1])
        assert abs(heading - PATH.heading(s)) < gait.pelvis_yaw_rad + 0.02
    assert gait.travelled(3.0) - gait.travelled(2.0) == pytest.approx(gait.speed_m_s)


def test_rotations_against_rodrigues() -> None:
    for turn, axis in ((about_x, [1, 0, 0]), (about_y, [0, 1, 0]), (about_z, [0, 0, 1])):
        assert turn(0.7) == pytest.approx(about(np.array(axis, dtype=float), 0.7))
    made = frame_between(
        np.array([0.0, 0.1, -2.0]),
        np.array([1.0, 0, 0]),
        np.array([1.0, 1, 0]),
        np.array([0, 0, 1.0]),
    )
    assert made @ made.T == pytest.approx(np.eye(3))
    assert np.linalg.det(made) == pytest.approx(1.0)
    rest = np.array([0.0, 0.1, -2.0]) / np.linalg.norm([0.0, 0.1, -2.0])
    assert made @ rest == pytest.approx([0.5**0.5, 0.5**0.5, 0.0])
