# SPDX-License-Identifier: Apache-2.0
"""Poses to begin with: moments of random motions of every family, and which of them are alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64
from scipy.spatial.transform import Rotation

from rfgs_core.articulated import Body, Pose
from rfgs_core.limbs.evidence.library import about_z, headings_of, over_origin
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.motion import random_motion

#: Moments of each family. Those that differ most from each other have most.
SHARES = {
    "walk": 40, "stand": 8, "gesture": 10, "reach_high": 12, "sit": 80, "squat": 24, "lie": 50,
    "fall": 50, "crawl": 16, "stairs": 10,
}  # fmt: skip
#: So many of the others count as like a pose.
ALIKE = 12


@dataclass(frozen=True)
class PoseBook:
    """Poses that face along x with the pelvis above the origin."""

    poses: list[Pose]
    """One for each page."""
    alike: Int64[np.ndarray, "page alike"]
    """Pages that are most like each, by mean distance of their joints, the nearest first."""

    @staticmethod
    def of(body: Body, seed: int) -> PoseBook:
        """Moments of random motions of a body."""
        rng = np.random.default_rng(sub_seed(seed, "postures"))
        poses, joints = [], []
        for family, count in SHARES.items():
            for _ in range(count):
                motion = random_motion(rng, body, family)
                pose = over_origin(body, motion.at(rng.uniform(0.0, motion.duration_s)))
                heading = float(headings_of(body.joints17(pose)[None])[0])
                poses.append(pose.turned(about_z(-heading)))
                joints.append(body.joints17(poses[-1]))
        return PoseBook(poses, _alike(np.array(joints)))


def blend(one: Pose, other: Pose, share: float) -> Pose:
    """A pose on the way from one to another, every joint turned by a share of what it differs."""
    here, there = one.local(), other.local()
    turn = Rotation.from_matrix(np.swapaxes(here, 1, 2) @ there).as_rotvec()
    local = here @ Rotation.from_rotvec(share * turn).as_matrix()
    return Pose.from_local((1.0 - share) * one.root + share * other.root, local)


def _alike(joints: Float64[np.ndarray, "page 17 3"]) -> Int64[np.ndarray, "page alike"]:
    away = np.linalg.norm(joints[:, None] - joints[None], axis=3).mean(axis=2)
    np.fill_diagonal(away, np.inf)
    return np.argsort(away, axis=1)[:, :ALIKE].astype(np.int64)
