# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rfgs_core.articulated import Body, Pose, fit_pose, fit_shape, people
from rfgs_core.errors import RfgsError
from rfgs_core.skeleton import JOINTS, PARENTS

RandomPose = Callable[[Body, np.random.Generator], Pose]
SIDES = ("left", "right")


def test_joints_of_random_poses_are_met(random_pose: RandomPose) -> None:
    rng = np.random.default_rng(0)
    for number in range(60):
        body = people().random(rng, child=number % 5 == 0)
        joints = body.joints17(random_pose(body, rng))
        off = body.joints17(fit_pose(body, joints, np.ones(17))) - joints
        assert np.linalg.norm(off, axis=1).max() < 0.015


def test_a_fit_goes_on_from_the_frame_before(mean_body: Body, random_pose: RandomPose) -> None:
    pose = random_pose(mean_body, np.random.default_rng(3))
    joints = mean_body.joints17(pose)
    again = fit_pose(mean_body, joints, np.ones(17), start=pose.moved(np.full(3, 0.05)))
    assert np.linalg.norm(mean_body.joints17(again) - joints, axis=1).max() < 0.015


def test_joints_that_do_not_count_may_be_anywhere(mean_body: Body, random_pose: RandomPose) -> None:
    joints = mean_body.joints17(random_pose(mean_body, np.random.default_rng(4)))
    weight = np.ones(17)
    lost = JOINTS.index("left_wrist")
    weight[lost], given = 0.0, joints.copy()
    given[lost] = np.nan
    found = mean_body.joints17(fit_pose(mean_body, given, weight))
    assert np.isfinite(found).all()
    assert np.linalg.norm(np.delete(found - joints, lost, axis=0), axis=1).max() < 0.015


def test_knees_that_bend_forward_are_straightened(mean_body: Body) -> None:
    joints = mean_body.joints17(mean_body.rest)
    knee = JOINTS.index("left_knee")
    joints[knee, 0] += 0.15
    joints[JOINTS.index("left_ankle"), 0] -= 0.3
    forward = joints.copy()
    forward[JOINTS.index("left_ankle"), 0] += 1.0

    def off(given: np.ndarray) -> float:
        found = mean_body.joints17(fit_pose(mean_body, given, np.ones(17)))
        return float(np.linalg.norm(found - given, axis=1).max())

    assert off(forward) > off(joints) + 0.05


@pytest.mark.parametrize(
    ("joints", "weight"),
    [
        (np.zeros((16, 3)), np.ones(17)),
        (np.zeros((17, 3)), np.zeros(17)),
        (np.full((17, 3), np.nan), np.ones(17)),
    ],
)
def test_joints_that_make_no_body_are_refused(
    mean_body: Body, joints: np.ndarray, weight: np.ndarray
) -> None:
    with pytest.raises(RfgsError, match="joints of a pose"):
        fit_pose(mean_body, joints, weight)


def test_lengths_of_limbs_tell_the_shape(random_pose: RandomPose) -> None:
    rng = np.random.default_rng(6)
    for seed in range(4):
        body = people().body(people().coefficients(np.random.default_rng(seed)))
        joints = np.stack([body.joints17(random_pose(body, rng)) for _ in range(10)])
        joints[0] = np.nan
        found = people().body(fit_shape(joints))
        assert found.height_m == pytest.approx(body.height_m, abs=0.05)
        # Shins, fixed by what was fitted.
        legs = [np.linalg.norm(one.heads[15] - one.heads[16]) for one in (body, found)]
        assert legs[0] == pytest.approx(legs[1], abs=0.02)


def test_unsure_joints_tell_little_of_the_shape(random_pose: RandomPose) -> None:
    rng = np.random.default_rng(8)
    arms = [JOINTS.index(f"{side}_{at}") for side in SIDES for at in ("elbow", "wrist")]
    for height in (-1.5, 1.5):
        body = people().body(np.array([height]))
        joints = np.stack([body.joints17(random_pose(body, rng)) for _ in range(10)])
        sigma = np.full(joints.shape[:2], 0.01)
        sigma[:, arms] = 0.4
        # The mean of a hand that may be anywhere is near the shoulder.
        for side in SIDES:
            shoulder = joints[:, JOINTS.index(f"{side}_shoulder")]
            for at in ("elbow", "wrist"):
                joints[:, JOINTS.index(f"{side}_{at}")] = shoulder
        told, plain = (
            people().body(fit_shape(joints, sigma_m=given)).height_m for given in (sigma, None)
        )
        assert told == pytest.approx(body.height_m, abs=0.02)
        assert abs(plain - body.height_m) > 0.1


def test_means_are_shorter_than_limbs(random_pose: RandomPose) -> None:
    """Known to ±σ, ends of a limb of length L are √(L² - 0.45 (σ² + σ²)) apart."""
    rng = np.random.default_rng(9)
    body, sigma_m = people().body(np.array([1.0])), 0.08
    joints = np.stack([body.joints17(random_pose(body, rng)) for _ in range(10)])
    means = joints.copy()
    for joint in range(1, 17):
        limb = joints[:, joint] - joints[:, PARENTS[joint]]
        length = np.linalg.norm(limb, axis=1, keepdims=True)
        shorter = np.sqrt(np.maximum(length**2 - 0.9 * sigma_m**2, 0.0))
        means[:, joint] = means[:, PARENTS[joint]] + limb * shorter / length
    told = people().body(fit_shape(means, sigma_m=np.full(joints.shape[:2], sigma_m)))
    plain = people().body(fit_shape(means))
    assert told.height_m == pytest.approx(body.height_m, abs=0.02)
    assert plain.height_m < body.height_m - 0.03


def test_a_sequence_without_limbs_is_refused() -> None:
    with pytest.raises(RfgsError, match="no limb"):
        fit_shape(np.full((3, 17, 3), np.nan))
    with pytest.raises(RfgsError, match="expected"):
        fit_shape(np.zeros((17, 3)))
