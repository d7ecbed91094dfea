# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from blender_scenes.motion.feet import Feet, feet_at, solve_leg
from blender_scenes.motion.footsteps import EndlessSteps
from blender_scenes.motion.gait import Gait, Manner, pelvis_at
from blender_scenes.motion.path import ArcPath
from blender_scenes.motion.rotations import (
    about,
    about_x,
    about_y,
    about_z,
    frame_between,
    matrices,
    quaternions,
    slerp,
)
from blender_scenes.motion.skeleton import Legs

PATH = ArcPath((0.2, -0.1), 0.3, 4.0, -0.8)


def endless(gait: Gait) -> EndlessSteps:
    return EndlessSteps(PATH, gait.step_m, gait.stance, gait.width_m, gait.toe_out_rad)


def feet_after(gait: Gait, legs: Legs, time_s: float) -> Feet:
    return feet_at(gait, legs, endless(gait), time_s / gait.step_s)


def pelvis_after(gait: Gait, legs: Legs, time_s: float) -> tuple[np.ndarray, np.ndarray]:
    return pelvis_at(gait, legs, endless(gait), time_s / gait.step_s)


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
    feet = [feet_after(gait, legs, t) for t in times]
    ankle = np.array([f.ankle for f in feet])
    both = np.array([f.planted for f in feet])
    both = both[1:] & both[:-1]
    assert both.mean() > 0.2
    moved = np.linalg.norm(np.diff(ankle, axis=0), axis=2)
    assert moved[both].max() < 1e-9
    # While the heel rises the toes stay where they are.
    toe = np.array([f.ankle + np.einsum("sij,sj->si", f.foot, legs.toe - legs.ankle) for f in feet])
    cycles = 0.5 * times[:, None] / gait.step_s
    share = (cycles - np.array([0.0, 0.5])) % 1
    rolling = (share > gait.flat_from + 0.01) & (share < gait.stance - 0.02)
    rolling = rolling[1:] & rolling[:-1]
    assert np.linalg.norm(np.diff(toe, axis=0), axis=2)[rolling].max() < 1e-9


def test_feet_never_jump(legs: Legs) -> None:
    times = np.arange(0.0, 6.0, 0.002)
    ankle = np.array([feet_after(Gait(), legs, t).ankle for t in times])
    speed = np.linalg.norm(np.diff(ankle, axis=0), axis=2) / 0.002
    assert speed.max() < 3.0
    assert ankle[..., 2].min() > legs.ankle[0, 2] - 0.01


def test_legs_reach_every_footprint_without_stretching(legs: Legs) -> None:
    for time_s in np.arange(0.0, 6.0, 0.05):
        feet = feet_after(Gait(), legs, time_s)
        root, pelvis = pelvis_after(Gait(), legs, time_s)
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
        root, pelvis = pelvis_after(far, legs, time_s)
        stretches.append(solve_leg(legs, 0, root, pelvis, feet_after(far, legs, time_s))[2])
    assert max(stretches) > 1.0


def test_pelvis_follows_the_path_at_walking_speed(legs: Legs) -> None:
    gait = Gait()
    for time_s in (1.0, 2.5, 4.0):
        root, pelvis = pelvis_after(gait, legs, time_s)
        s = gait.speed_m_s * time_s - gait.stance * gait.step_m
        assert np.linalg.norm(root[:2] - PATH.position(s)) <= gait.sway_m + 1e-9
        heading = np.arctan2(-pelvis[1, 1], -pelvis[0, 1])
        assert abs(heading - PATH.heading(s)) < gait.pelvis_yaw_rad + 0.02


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


def test_quaternions_and_matrices_undo_each_other(rng: np.random.Generator) -> None:
    quats = rng.normal(size=(200, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True) * np.sign(quats[:, :1])
    assert quaternions(matrices(quats)) == pytest.approx(quats, abs=1e-12)
    half_turns = np.eye(4)[1:]
    assert np.abs((quaternions(matrices(half_turns)) * half_turns).sum(axis=1)) == pytest.approx(1)


def test_slerp_turns_evenly_on_the_shorter_way() -> None:
    first, second = quaternions(np.stack([about_z(0.2), about_z(-0.9)]))
    for share in (0.0, 0.25, 1.0):
        assert matrices(slerp(first, -second, share)) == pytest.approx(about_z(0.2 - 1.1 * share))
    assert slerp(first, first, 0.3) == pytest.approx(first)


def test_speed_sets_step_and_cadence_as_boulic_and_thalmann_measured(legs: Legs) -> None:
    hip_m = legs.hip[0, 2]
    for speed in (0.6, 1.0, 1.4):
        gait = Gait.for_speed(speed, legs, Manner())
        assert gait.speed_m_s == pytest.approx(speed)
        assert 2 * gait.step_m / hip_m == pytest.approx(1.346 * (speed / hip_m) ** 0.5)
        double_support = (2 * gait.stance - 1) * 2 * gait.step_s
        assert double_support == pytest.approx(2 * (0.252 * 2 * gait.step_s - 0.143))
    # Longer legs take longer steps at one speed, but fewer.
    tall = dataclasses.replace(legs, hip=1.2 * legs.hip)
    assert Gait.for_speed(1.2, tall, Manner()).step_s > Gait.for_speed(1.2, legs, Manner()).step_s
    with pytest.raises(ValueError, match="walking speed"):
        Gait.for_speed(4.0, legs, Manner())
