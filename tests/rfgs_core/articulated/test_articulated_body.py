# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

from rfgs_core.articulated import BONES, PARENTS, Body, Pose, facets_of, grounded, people
from rfgs_core.articulated.turns import turn_of, vector_of
from rfgs_core.errors import RfgsError
from rfgs_core.skeleton import JOINTS

RandomPose = Callable[[Body, np.random.Generator], Pose]


def test_skin_at_rest_is_the_stored_one(mean_body: Body) -> None:
    np.testing.assert_allclose(mean_body.skin(mean_body.rest), mean_body.vertices, atol=1e-9)
    np.testing.assert_allclose(mean_body.heads_at(mean_body.rest), mean_body.heads, atol=1e-9)


def test_mean_adult_stands_on_the_floor_and_is_of_ordinary_height(mean_body: Body) -> None:
    assert 1.6 < mean_body.height_m < 1.8
    assert mean_body.vertices[:, 2].min() == pytest.approx(0.0)
    place = dict(zip(JOINTS, mean_body.joints17(mean_body.rest), strict=True))
    assert place["left_hip"][1] > 0.05 > -0.05 > place["right_hip"][1]
    toes = mean_body.vertices[mean_body.vertices[:, 2] < 0.05]
    assert toes[:, 0].max() - place["left_ankle"][0] > 0.1, "looks along x"


def test_a_body_turned_as_a_whole_keeps_its_shape(mean_body: Body) -> None:
    turn, shift = turn_of(np.array([0.3, -1.0, 2.0])), np.array([1.0, 2.0, 3.0])
    pose = mean_body.rest.turned(turn).moved(shift)
    np.testing.assert_allclose(mean_body.skin(pose), mean_body.vertices @ turn.T + shift, atol=1e-9)


def test_a_bent_elbow_moves_only_what_hangs_on_it(mean_body: Body) -> None:
    local = np.tile(np.eye(3), (len(BONES), 1, 1))
    local[BONES.index("lowerarm_left")] = turn_of(np.array([0.0, -0.8, 0.0]))
    pose = Pose.from_local(mean_body.heads[0], local)
    moved = np.linalg.norm(mean_body.skin(pose) - mean_body.vertices, axis=1)
    bone, weight = mean_body.weights
    hangs = np.isin(bone, [BONES.index("lowerarm_left"), BONES.index("hand_left")])
    share = np.where(hangs, weight, 0.0).sum(axis=1)
    assert moved[share == 0.0].max() < 1e-9
    assert moved[share > 0.99].max() > 0.2
    joints = np.linalg.norm(mean_body.joints17(pose) - mean_body.joints17(mean_body.rest), axis=1)
    assert {JOINTS[j] for j in np.flatnonzero(joints > 1e-9)} == {"left_wrist"}


def test_local_rotations_go_there_and_back(mean_body: Body, random_pose: RandomPose) -> None:
    pose = random_pose(mean_body, np.random.default_rng(0))
    again = Pose.from_local(pose.root, pose.local())
    np.testing.assert_allclose(again.turns, pose.turns, atol=1e-12)


def test_limbs_hang_down_in_the_neutral_position(mean_body: Body) -> None:
    place = mean_body.joints17(Pose(mean_body.heads[0], mean_body.neutral))
    for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
        top, middle, end = (place[JOINTS.index(f"left_{name}")] for name in chain)
        np.testing.assert_allclose((top - end)[:2], 0.0, atol=1e-9)
        np.testing.assert_allclose((top - middle)[:2], 0.0, atol=1e-9)


def test_mirrored_pose_has_mirrored_joints(mean_body: Body, random_pose: RandomPose) -> None:
    pose = random_pose(mean_body, np.random.default_rng(1))
    names = [n.replace("left", "#").replace("right", "left").replace("#", "right") for n in JOINTS]
    other = mean_body.joints17(pose)[[JOINTS.index(name) for name in names]] * [1.0, -1.0, 1.0]
    # The body itself is a mirror image of itself to a few millimetres.
    np.testing.assert_allclose(mean_body.joints17(pose.mirrored()), other, atol=4e-3)


def test_grounded_bodies_touch_the_floor(mean_body: Body, random_pose: RandomPose) -> None:
    pose = grounded(mean_body, random_pose(mean_body, np.random.default_rng(2)), 0.4)
    assert mean_body.skin(pose)[:, 2].min() == pytest.approx(0.4)


def test_facets_close_the_body_and_look_outwards(mean_body: Body) -> None:
    centres, normals, areas = facets_of(mean_body.vertices, mean_body.faces)
    # Gauss: the flux of x/3 out of a body is its volume, that of a constant is nothing.
    volume = float(np.sum(areas * np.sum(centres * normals, axis=1)) / 3.0)
    assert 0.045 < volume < 0.09
    np.testing.assert_allclose((areas[:, None] * normals).sum(axis=0), 0.0, atol=1e-9)
    assert 1.4 < areas.sum() < 2.4
    np.testing.assert_allclose(np.linalg.norm(normals[areas > 1e-10], axis=1), 1.0, atol=1e-9)


def test_facet_of_a_triangle() -> None:
    corners = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 3.0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 0, 1]], np.int32)
    centres, normals, areas = facets_of(corners, faces)
    np.testing.assert_allclose(centres[0], [2 / 3, 1.0, 1.0])
    np.testing.assert_allclose(normals, [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(areas, [3.0, 0.0])


def test_random_people_differ_and_children_are_small() -> None:
    draws = {
        child: [people().random(np.random.default_rng(seed), child) for seed in range(12)]
        for child in (False, True)
    }
    heights = {child: np.array([body.height_m for body in drawn]) for child, drawn in draws.items()}
    assert heights[False].mean() > heights[True].mean() + 0.2
    assert heights[False].std() > 0.05 and heights[False].min() > 1.4
    assert heights[False].max() < 2.1 and 1.0 < heights[True].min()
    again = people().random(np.random.default_rng(3))
    np.testing.assert_array_equal(again.vertices, draws[False][3].vertices)


def test_clothes_push_the_skin_outwards(mean_body: Body) -> None:
    dressed = people().dressed(mean_body, {"torso": 0.02, "arms": 0.0, "legs": 0.0}, 0.0)
    volume = [
        np.sum(a * np.sum(c * n, axis=1)) / 3.0
        for c, n, a in (facets_of(b.vertices, b.faces) for b in (mean_body, dressed))
    ]
    assert 0.003 < volume[1] - volume[0] < 0.03
    np.testing.assert_allclose(np.ptp(dressed.heads, axis=0), np.ptp(mean_body.heads, axis=0))


def test_parents_come_before_children() -> None:
    assert PARENTS[0] == -1
    assert all(parent < row for row, parent in enumerate(PARENTS))
    assert len(BONES) == len(PARENTS) == 20


@pytest.mark.parametrize("given", [np.zeros(99), np.zeros((2, 2)), np.array([np.nan])])
def test_impossible_coefficients_are_refused(given: np.ndarray) -> None:
    with pytest.raises(RfgsError, match="coefficients of a body"):
        people().body(given)


def test_a_pose_of_other_bones_is_refused() -> None:
    with pytest.raises(RfgsError, match="turns"):
        Pose(np.zeros(3), np.zeros((19, 3, 3)))


@pytest.mark.parametrize("vector", [[0, 0, 0], [0.1, -0.2, 0.3], [2, 2, 0], [0, np.pi, 0]])
def test_vectors_of_rotations_go_there_and_back(vector: list[float]) -> None:
    given = np.array(vector, np.float64)
    turn = turn_of(given)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.abs(vector_of(turn)), np.abs(given), atol=1e-7)


def test_people_are_read_without_what_built_them() -> None:
    code = (
        "import sys; from rfgs_core.articulated import people; people();"
        "assert not {'bpy', 'anny', 'torch'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
