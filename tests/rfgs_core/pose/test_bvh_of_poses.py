# SPDX-License-Identifier: Apache-2.0
"""Exported motion capture, read back by the reader that the scenes use for other people's files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core.articulated import BONES, people
from rfgs_core.limbs.propose import Joints
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.motion_capture.bvh import read_bvh
from rfgs_core.pose.bvh import write_bvh
from rfgs_core.worlds.motion import random_motion

TIME_S = np.array([0.0, 0.1, 0.2, 0.4])


def posed() -> PosedPeople:
    """Somebody who walks."""
    rng = np.random.default_rng(8)
    body = people().random(rng)
    motion = random_motion(rng, body, "walk")
    xyz = np.array([[body.joints17(motion.at(0.3 + t))] for t in TIME_S])
    joints = Joints(xyz, np.full(xyz.shape[:3], 0.02))
    return PosedPeople.through(joints, shapes_of(joints))


def test_bones_come_back_where_they_were(tmp_path: Path) -> None:
    walker = posed()
    write_bvh(tmp_path / "walk.bvh", walker, 0, TIME_S)
    file = read_bvh(tmp_path / "walk.bvh")
    assert set(file.joints) >= set(BONES) and abs(file.frame_s - 0.1) < 1e-6
    # The frame that the run lacks is put between its neighbours.
    assert len(file.root) == 5
    ours = file.places()[..., [0, 2, 1]] * [1.0, -1.0, 1.0]
    body = walker.body(0)
    for frame, row in ((0, 0), (1, 1), (2, 2), (3, 4)):
        heads = body.heads_at(walker.pose(frame, 0))
        got = np.array([ours[row, file.joints.index(bone)] for bone in BONES])
        np.testing.assert_allclose(got, heads, atol=2e-4)


def test_uneven_times_end_with_the_last_pose(tmp_path: Path) -> None:
    walker, times_s = posed(), np.array([0.0, 0.1, 0.25, 0.37])
    write_bvh(tmp_path / "walk.bvh", walker, 0, times_s)
    file = read_bvh(tmp_path / "walk.bvh")
    assert (len(file.root) - 1) * file.frame_s == pytest.approx(0.37, abs=1e-5)
    ours = file.places()[..., [0, 2, 1]] * [1.0, -1.0, 1.0]
    heads = walker.body(0).heads_at(walker.pose(3, 0))
    got = np.array([ours[-1, file.joints.index(bone)] for bone in BONES])
    np.testing.assert_allclose(got, heads, atol=2e-4)


def test_a_single_frame_is_a_motion_too(tmp_path: Path) -> None:
    one = posed()
    still = PosedPeople(one.coefficients, one.root[:1], one.turns[:1])
    write_bvh(tmp_path / "one.bvh", still, 0, TIME_S[:1])
    assert len(read_bvh(tmp_path / "one.bvh").root) == 1
