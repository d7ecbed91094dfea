# SPDX-License-Identifier: Apache-2.0
"""A body keeps its bones, is found again in a cloud around it, and errors are what they are."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import maxwell

from rfgs_core.articulated import people
from rfgs_core.cli.pose import _missed, _seen
from rfgs_core.figures.poses import ahead
from rfgs_core.limbs.evidence.library import upright
from rfgs_core.pose.body import (
    BONES,
    PARAMETERS,
    RADIUS_M,
    distance_to_bones,
    index_of,
    joints_of,
)
from rfgs_core.pose.confidence import NEAR_M, SEEN_M, confidence
from rfgs_core.pose.estimate import PoseEstimate, headings_of
from rfgs_core.pose.fit import Cloud, fit_body, standing
from rfgs_core.pose.score import score_poses
from rfgs_core.skeleton import JOINTS

STRIDE = {
    "x": 1.0,
    "y": -0.5,
    "height": 1.78,
    "heading": 0.7,
    "sink": 0.04,
    "left_hip": 0.5,
    "right_hip": -0.35,
    "left_knee": 0.1,
    "right_knee": 0.5,
    "left_shoulder": -0.5,
    "right_shoulder": 0.6,
    "left_elbow": 0.2,
    "right_elbow": 0.5,
}


def parameters(**values: float) -> np.ndarray:
    """A body with the given parameters and zeros elsewhere."""
    return np.array([values.get(name, 0.0) for name in PARAMETERS])


def around(joints: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
    """Points on the surface around the bones."""
    rng = np.random.default_rng(seed)
    length = np.linalg.norm(joints[BONES[:, 1]] - joints[BONES[:, 0]], axis=1)
    area = length * RADIUS_M
    bone = rng.choice(len(BONES), count, p=area / area.sum())
    start, end = joints[BONES[bone, 0]], joints[BONES[bone, 1]]
    along = (end - start) / length[bone, None]
    across = np.cross(along, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return start + rng.uniform(size=(count, 1)) * (end - start) + RADIUS_M[bone, None] * across


def test_a_standing_body_has_its_proportions() -> None:
    joints = joints_of(parameters(height=2.0), floor_m=0.1)
    place = dict(zip(JOINTS, joints, strict=True))
    assert place["pelvis"] == pytest.approx([0.0, 0.0, 0.1 + 1.06])
    assert place["left_ankle"][2] == pytest.approx(0.1 + 0.078)
    # Looking along x, left is along y; arms hang.
    assert place["left_shoulder"] == pytest.approx([0.0, 0.259, 0.1 + 1.636])
    assert place["right_wrist"] == pytest.approx([0.0, -0.259, 0.1 + 1.636 - 2 * 0.332])


def test_bones_keep_their_length_in_every_pose() -> None:
    still = joints_of(parameters(height=1.78), 0.0)
    moving = joints_of(parameters(**STRIDE, pitch=0.3, roll=-0.2), 0.0)

    def lengths(joints: np.ndarray) -> np.ndarray:
        return np.linalg.norm(joints[BONES[:, 1]] - joints[BONES[:, 0]], axis=1)

    np.testing.assert_allclose(lengths(moving), lengths(still), rtol=1e-12)
    # The left leg swings ahead along the heading.
    ahead = np.array([np.cos(0.7), np.sin(0.7)])
    knee = moving[JOINTS.index("left_knee"), :2] - moving[JOINTS.index("left_hip"), :2]
    assert knee @ ahead == pytest.approx(0.245 * 1.78 * np.sin(0.5))


def test_distance_to_a_bone_is_that_to_a_capsule() -> None:
    joints = joints_of(parameters(height=1.7), 0.0)
    shank = int(np.flatnonzero(BONES[:, 1] == JOINTS.index("left_ankle"))[0])
    ankle = joints[JOINTS.index("left_ankle")]
    points = np.array([ankle + np.array([0.2, 0.0, 0.1]), ankle - np.array([0.0, 0.0, 0.3])])
    found = distance_to_bones(points, joints)[:, shank]
    np.testing.assert_allclose(found, np.array([0.2, 0.3]) - RADIUS_M[shank], atol=1e-12)


def test_a_stride_is_found_in_its_own_cloud() -> None:
    truth = parameters(**STRIDE)
    joints = joints_of(truth, 0.0)
    cloud = Cloud(around(joints, 1500), np.ones(1500), floor_m=0.0)
    found = fit_body(cloud, [0.0, np.pi / 2, np.pi, -np.pi / 2])
    error = np.linalg.norm(joints_of(found.parameters, 0.0) - joints, axis=1)
    baseline = np.linalg.norm(joints_of(standing(cloud, 0.7), 0.0) - joints, axis=1)
    # The prior of the height costs some 4 cm.
    assert error.mean() < 0.065
    assert error.mean() < 0.4 * baseline.mean()
    turned = found.parameters[index_of("heading")] - 0.7
    assert abs(np.angle(np.exp(1j * turned))) < 0.25


def test_who_is_known_to_sit_is_found_on_the_chair_from_a_blurred_cloud() -> None:
    """Blur hides which way knees bend; the posture says it."""
    joints = joints_of(
        parameters(
            **{"x": 1.0, "y": -0.5, "height": 1.75, "heading": 0.7, "sink": 0.42, "pitch": 0.1},
            **dict.fromkeys(("left_hip", "right_hip", "left_knee", "right_knee"), 1.5),
            **dict.fromkeys(("left_shoulder", "right_shoulder"), 0.6),
        ),
        0.0,
    )
    points = around(joints, 1500) + np.random.default_rng(1).normal(0, 0.08, (1500, 3))
    cloud = Cloud(points, np.ones(1500), floor_m=0.0)
    known, unknown = (fit_body(cloud, [0.7], seated=seated) for seated in (True, False))
    errors = [
        np.linalg.norm(joints_of(found.parameters, 0.0) - joints, axis=1).mean()
        for found in (known, unknown)
    ]
    assert errors[0] < 0.07
    assert errors[0] < 0.6 * errors[1]


def test_limbs_that_are_not_seen_keep_the_earlier_pose_for_a_while() -> None:
    still = around(joints_of(parameters(height=1.78, x=1.0, y=-0.5, heading=0.7), 0.0), 3000)
    trunk = still[still[:, 2] > 1.0]
    cloud = Cloud(trunk, np.ones(len(trunk)), floor_m=0.0)
    hip = index_of("left_hip")
    soon = fit_body(cloud, [0.7], parameters(**STRIDE), elapsed_s=0.01).parameters[hip]
    later = fit_body(cloud, [0.7], parameters(**STRIDE), elapsed_s=3.0).parameters[hip]
    assert abs(soon - 0.5) < 0.15
    assert abs(later) < 0.15


def test_headings_follow_the_track_and_are_open_at_rest() -> None:
    time_s = np.array([0.0, 0.5, 1.0, 1.5])
    walking = np.array([[0.0, 0.0], [0.5, 0.5], [1.0, 1.0], [1.5, 1.5]])
    assert headings_of(time_s, walking) == [[pytest.approx(np.pi / 4)]] * 4
    assert [len(ways) for ways in headings_of(time_s, 0.01 * walking)] == [4] * 4
    # Ten seconds apart, nobody knows the way.
    assert [len(ways) for ways in headings_of(20 * time_s, 20 * walking)] == [4] * 4
    assert headings_of(time_s[:1], walking[:1]) == [[0.0, np.pi / 2, np.pi, -np.pi / 2]]


def scored(
    joints: np.ndarray,
    truth: np.ndarray,
    seated: np.ndarray | None = None,
    heights_m: np.ndarray | None = None,
    sigma_m: np.ndarray | None = None,
) -> dict:
    """Scores of estimated joints (frame, body, 17, 3) against true ones, on a floor at 0.2 m."""
    sits = np.zeros(joints.shape[:2], bool) if seated is None else seated
    estimate = PoseEstimate(
        *(list(range(len(joints))), np.arange(len(joints)), joints[:, :, 0], joints, sits),
        joints + 0.3,
        sigma_m=sigma_m,
        heights_m=heights_m,
    )
    bounds_m = np.array([[0.0, 0.0, 0.2], [4.0, 4.0, 2.4]])
    sequence = SimpleNamespace(
        joints=lambda frame: truth[frame].astype(np.float32), bounds_m=bounds_m
    )
    return score_poses(estimate, sequence)  # type: ignore[arg-type]


def test_scores_of_shifted_and_swapped_people() -> None:
    both = np.stack([joints_of(parameters(height=1.7, x=x), 0.0) for x in (0.0, 2.0)])
    truth = np.stack([both, both, both])
    shifted = scored(truth + np.array([0.0, 0.03, 0.04]), truth)
    assert shifted["fit"]["mpjpe_m"] == pytest.approx(0.05, abs=1e-6)
    assert shifted["fit"]["aligned_m"] == pytest.approx(0.0, abs=1e-6)
    assert shifted["fit"]["joints_m"]["left_wrist"] == pytest.approx(0.05, abs=1e-6)
    assert shifted["standing"]["mpjpe_m"] > 0.4
    one_off = truth.copy()
    one_off[:, 1, :, 2] += 0.07
    # Of the second person, whichever body it is.
    assert scored(one_off[:, ::-1], truth)["fit"]["people_m"] == pytest.approx(
        [0.0, 0.07], abs=1e-6
    )
    assert shifted["tracked"] == 1.0 and shifted["identity_kept"] == 1.0
    swapped = truth.copy()
    swapped[2] = truth[2, ::-1]
    found = scored(swapped, truth)
    assert found["fit"]["mpjpe_m"] == pytest.approx(0.0, abs=1e-6)
    assert found["identity_kept"] == pytest.approx(4 / 6)
    away = scored(truth + np.array([0.6, 0.0, 0.0]), truth)
    assert away["tracked"] == 0.0


def test_postures_are_held_against_the_height_of_the_pelvis() -> None:
    upright = joints_of(parameters(height=1.7), 0.2)
    on_a_chair = joints_of(parameters(height=1.7, sink=0.4, x=2.0), 0.2)
    truth = np.stack([np.stack([upright, on_a_chair])] * 2)
    found = scored(truth, truth, np.array([[False, True], [True, False]]))
    assert found["posture_right"] == pytest.approx(0.5) and found["seated"] == 2


def test_heights_are_those_of_the_people_who_were_matched() -> None:
    """Bodies come in the order of places, people in that of the scene."""
    bodies = [people().body(np.array([height])) for height in (-1.5, 1.0)]
    tall, small = (
        np.repeat(body.joints17(upright(body))[None] + [x, 0.0, 0.2], 3, axis=0)
        for body, x in zip(bodies[::-1], (0.0, 2.0), strict=True)
    )
    truth, found = np.stack([small, tall], axis=1), np.stack([tall, small], axis=1)
    result = scored(found, truth, heights_m=np.array([1.81, 1.52]))
    assert result["heights_m"] == pytest.approx([1.52, 1.81])
    true_m = [body.height_m for body in bodies]
    assert result["true_heights_m"] == pytest.approx(true_m, abs=0.03)
    assert scored(found, truth)["heights_m"] is None
    nothing_known = scored(found, np.full_like(truth, np.nan), heights_m=np.array([1.81, 1.52]))
    assert nothing_known["heights_m"] == [1.81, 1.52]
    assert nothing_known["true_heights_m"] is None


def test_seen_joints_are_those_that_are_expected_to_be_near() -> None:
    """Of one body the left arm is unsure, and a joint that was sure is far off."""
    truth = joints_of(parameters(height=1.7), 0.2)[None, None].repeat(4, axis=0)
    sigma_m, found = np.full((4, 1, 17), 0.02), truth + np.array([0.03, 0.0, 0.0])
    arm = [JOINTS.index(f"left_{name}") for name in ("elbow", "wrist")]
    sigma_m[:, :, arm] = 0.12
    found[:, :, arm] += [0.2, 0.0, 0.0]
    found[0, 0, JOINTS.index("head")] += [0.0, 0.0, 0.1]
    result = scored(found, truth, sigma_m=sigma_m)
    assert result["joints_seen"]["left_wrist"] == 0.0 and result["joints_seen"]["head"] == 1.0
    assert result["confidence"]["seen"] == pytest.approx(15 / 17)
    assert result["confidence"]["seen_near"] == pytest.approx(59 / 60)
    error_m = np.linalg.norm(found - truth, axis=3)
    assert result["confidence"]["error_over_sigma"] == pytest.approx(error_m.sum() / sigma_m.sum())
    printed = _seen(result["joints_seen"], result["confidence"])
    assert "88 % of joints" in printed and "98 % of these" in printed
    assert "unsure    left elbow, left wrist\n" in printed
    assert scored(found, truth)["confidence"] is None
    # Nobody's joints are known: what is seen is said, not whether it is right.
    unknown = scored(found, np.full_like(truth, np.nan), sigma_m=sigma_m)
    assert unknown["confidence"] is None and unknown["joints_seen"]["head"] == 1.0


@pytest.mark.parametrize("heading", [0.4, 0.4 + np.pi, -0.7, 2.2])
def test_skeletons_are_looked_at_from_the_side(heading: float) -> None:
    """Whichever way along their line people go, and though they pass each other."""
    there = joints_of(parameters(**(STRIDE | {"heading": heading})), 0.0)
    back = joints_of(parameters(**(STRIDE | {"heading": heading + np.pi, "x": 3.0})), 0.0)
    found = ahead(np.stack([there, back])[None])
    assert -0.25 * np.pi < found <= 0.75 * np.pi
    assert abs(np.sin(found - heading)) < 0.05


def test_errors_as_large_as_expected_are_told_from_smaller_ones() -> None:
    """Of errors that are normal and alike along the axes the mean length is 1.596 deviations."""
    drawn = np.linalg.norm(np.random.default_rng(0).normal(size=(4000, 17, 3)), axis=2)
    error_m = SEEN_M / np.sqrt(8.0 / np.pi) * drawn
    result = confidence(error_m, np.full_like(error_m, SEEN_M))
    assert result["seen"] == 1.0 and result["error_over_sigma"] == pytest.approx(1.0, abs=0.01)
    # Maxwell's distribution at 2.13 deviations.
    assert result["seen_near"] == pytest.approx(maxwell.cdf(NEAR_M / SEEN_M * 1.596), abs=0.01)
    unsure = confidence(error_m, np.full_like(error_m, 2.0 * SEEN_M))
    assert unsure == {
        "seen": 0.0, "seen_near": None, "error_over_sigma": pytest.approx(0.5, abs=0.01)
    }  # fmt: skip


def test_errors_say_of_how_many_people_they_are() -> None:
    """Without the body that is further off the mean is smaller, but not of everybody."""
    truth = np.stack([joints_of(parameters(x=x), 0.0) for x in (0.0, 2.0)])[None].repeat(2, axis=0)
    both = truth + np.array([0.1, 0.3])[:, None, None]
    whole, half = scored(both, truth), scored(both[:, :1], truth)
    assert half["fit"]["mpjpe_m"] < whole["fit"]["mpjpe_m"]
    assert (whole["matched"], half["matched"], half["people"]) == (4, 2, 4)
    assert _missed(4, 4) == ""
    assert _missed(2, 4).startswith("errors    of 2 of 4 people")


def test_unknown_joints_have_no_error() -> None:
    truth = np.full((2, 1, 17, 3), np.nan)
    found = scored(np.zeros((2, 1, 17, 3)), truth)
    assert found["fit"]["mpjpe_m"] is None
    assert found["tracked"] is None and found["identity_kept"] is None
    assert found["posture_right"] is None
