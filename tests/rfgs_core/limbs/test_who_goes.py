# SPDX-License-Identifier: Apache-2.0
"""Who goes somewhere looks there, their arms hanging, as far as nothing surer is said of them."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.articulated import Body
from rfgs_core.limbs.evidence.library import Stride, about_z, headings_of
from rfgs_core.limbs.postures.going import facing, fronts, hanging
from rfgs_core.limbs.propose import Joints
from rfgs_core.limbs.tokens import MIRRORED
from rfgs_core.skeleton import JOINTS

TIME_S = np.arange(8) * 0.2
WRISTS = [JOINTS.index(f"{side}_wrist") for side in ("left", "right")]
ARMS = [JOINTS.index(f"{side}_elbow") for side in ("left", "right")] + WRISTS
REST = [joint for joint in range(17) if joint not in ARMS]
HEADING = 0.7
WAY = np.array([np.cos(HEADING), np.sin(HEADING), 0.0])
#: Tips somebody over to where they go.
TIPPED = about_z(HEADING) @ [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]] @ about_z(-HEADING)


@pytest.fixture
def walk(stride: Stride, walker_body: Body) -> np.ndarray:
    """Joints of somebody who goes 0.9 m/s, their arms swinging; shape (frame, 1, 17, 3)."""
    poses = [stride.poses[moment % len(stride.poses)] for moment in range(len(TIME_S))]
    turned = np.array([walker_body.joints17(pose) for pose in poses]) @ about_z(HEADING).T
    way = 0.9 * TIME_S[:, None] * [np.cos(HEADING), np.sin(HEADING)]
    turned[..., :2] += way[:, None] - turned[:, [0], :2]
    return turned[:, None]


def at_speed(walk: np.ndarray, times: float) -> np.ndarray:
    """The same, who goes at so many times 0.9 m/s."""
    own = walk - walk[:, :, :1] * [1.0, 1.0, 0.0]
    return own + times * 0.9 * TIME_S[:, None, None, None] * WAY


def bent(walk: np.ndarray, sigma_m: float) -> Joints:
    """Arms stretched out ahead, which is what is said of them, this far off."""
    xyz, sigma = walk.copy(), np.full(walk.shape[:3], 0.05)
    xyz[:, :, ARMS] += [0.3 * np.cos(HEADING), 0.3 * np.sin(HEADING), 0.4]
    sigma[:, :, ARMS] = sigma_m
    return Joints(xyz, sigma)


def off(joints: Joints, truth: np.ndarray) -> np.ndarray:
    """How far wrists are off in each frame [m]."""
    return np.linalg.norm(joints.xyz - truth, axis=-1)[:, 0, WRISTS].mean(axis=1)


def turned(walk: np.ndarray, degrees: float, sigma_m: float) -> Joints:
    """Everything around the middle of the body, which is said of it, this far off."""
    middle = walk.mean(axis=2, keepdims=True)
    xyz = (walk - middle) @ about_z(np.radians(degrees)).T + middle
    sigma = np.full(walk.shape[:3], sigma_m)
    sigma[:, :, 0] = sigma_m / 3.0
    return Joints(xyz, sigma)


def heading_off(xyz: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """By how many degrees a heading is off in each frame."""
    off = headings_of(xyz[:, 0]) - headings_of(truth[:, 0])
    return np.degrees(np.abs(np.angle(np.exp(1j * off))))


def test_an_unsure_heading_of_who_goes_comes_near_the_way(walk: np.ndarray) -> None:
    for degrees in (-50.0, 50.0):
        said = turned(walk, degrees, 0.14)
        told = facing(said, TIME_S)
        # At either end the way is half as long.
        assert heading_off(told.xyz, walk)[1:-1].max() < 15.0
        assert heading_off(told.xyz, walk).max() < 20.0
        error_m = np.linalg.norm(told.xyz - walk, axis=-1).mean()
        assert error_m < 0.4 * np.linalg.norm(said.xyz - walk, axis=-1).mean()
        np.testing.assert_array_equal(told.sigma_m, said.sigma_m)
        np.testing.assert_allclose(told.xyz.mean(axis=2), said.xyz.mean(axis=2), atol=1e-9)


def test_a_sure_heading_stays(walk: np.ndarray) -> None:
    said = turned(walk, 10.0, 0.01)
    assert heading_off(facing(said, TIME_S).xyz, said.xyz).max() < 2.0


def test_who_surely_goes_sideways_or_is_slow_or_alone_in_time_keeps_their_heading(
    walk: np.ndarray,
) -> None:
    for said in (turned(walk, 90.0, 0.05), turned(at_speed(walk, 0.5), 40.0, 0.14)):
        np.testing.assert_array_equal(facing(said, TIME_S).xyz, said.xyz)
    said = turned(walk[:1], 40.0, 0.14)
    np.testing.assert_array_equal(facing(said, TIME_S[:1]).xyz, said.xyz)


def test_a_back_taken_for_a_front_in_single_frames_is_noticed(walk: np.ndarray) -> None:
    sigma_m = np.tile(np.random.default_rng(0).uniform(0.05, 0.1, 17), (8, 1, 1))
    for wrong in ([3], [0], [2, 5], [6, 7]):
        said = Joints(walk.copy(), sigma_m.copy())
        for values in said:
            values[wrong] = values[wrong][:, :, MIRRORED]
        found = fronts(said, TIME_S)
        np.testing.assert_array_equal(found.xyz, walk)
        np.testing.assert_array_equal(found.sigma_m, sigma_m)


def test_who_stands_or_lies_or_sits_down_keeps_what_is_said(walk: np.ndarray) -> None:
    stays = np.repeat(walk[:1, :, MIRRORED], len(walk), axis=0)
    hips = walk[:1, :, :1]
    lies = np.repeat((walk[:1] - hips) @ TIPPED.T + hips, len(walk), axis=0)
    lies[4] = lies[4][:, MIRRORED]
    # Half a metre backwards in a second, as onto a chair, and up again.
    backwards = 0.25 * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, 21)))
    sits = np.repeat(walk[:1], 21, axis=0) - backwards[:, None, None, None] * WAY
    for xyz, time_s in ((stays, TIME_S), (lies, TIME_S), (sits, np.arange(21) * 0.1)):
        said = Joints(xyz, np.full(xyz.shape[:3], 0.1))
        np.testing.assert_array_equal(fronts(said, time_s).xyz, xyz)


def test_unsure_arms_of_who_goes_come_near_the_true_ones(walk: np.ndarray) -> None:
    said = bent(walk, 0.4)
    told = hanging(said, TIME_S)
    assert off(said, walk).min() > 0.49
    assert (off(told, walk) < off(said, walk)).all()
    assert off(told, walk).mean() < 0.5 * off(said, walk).mean()
    np.testing.assert_allclose(told.xyz[:, :, REST], said.xyz[:, :, REST], atol=1e-12)
    np.testing.assert_allclose(told.sigma_m[:, :, REST], said.sigma_m[:, :, REST])
    assert (told.sigma_m[:, :, ARMS] < 0.13).all()


def test_sure_arms_stay(walk: np.ndarray) -> None:
    said = bent(walk, 0.02)
    told = hanging(said, TIME_S)
    # 0.02² / (0.02² + 0.12²) of the way of half a metre and a swing.
    assert np.linalg.norm(told.xyz - said.xyz, axis=-1)[..., WRISTS].max() < 0.03


def test_who_is_slow_or_jumps_or_crawls_is_left_alone(walk: np.ndarray) -> None:
    for speed in (0.5, 5.0):
        said = bent(at_speed(walk, speed), 0.4)
        assert hanging(said, TIME_S) is said
    said, hips = bent(walk, 0.4), walk[:, :, :1]
    tipped = Joints((said.xyz - hips) @ TIPPED.T + hips, said.sigma_m)
    head = tipped.xyz[0, 0, JOINTS.index("head")] - tipped.xyz[0, 0, 0]
    assert head @ WAY > 0.5
    assert hanging(tipped, TIME_S) is tipped


def test_the_longer_somebody_stays_the_less_is_known_of_arms(walk: np.ndarray) -> None:
    frozen = at_speed(np.repeat(walk[:1], len(walk), axis=0), 1.0)
    frozen[5:] = frozen[4]
    said = bent(frozen, 0.4)
    told = hanging(said, TIME_S)
    sigma = told.sigma_m[:, 0, WRISTS[0]]
    assert (np.diff(sigma)[4:] > 0.0).all()
    np.testing.assert_allclose(np.diff(sigma)[:3], 0.0, atol=1e-12)
    moved = np.linalg.norm(told.xyz - said.xyz, axis=-1)[:, 0, WRISTS].mean(axis=1)
    assert (np.diff(moved)[4:] < 0.0).all()


def test_a_single_frame_is_left_alone(walk: np.ndarray) -> None:
    said = bent(walk[:1], 0.4)
    assert hanging(said, TIME_S[:1]) is said
