# SPDX-License-Identifier: Apache-2.0
"""Joints over time on curves, and bodies that follow them."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.articulated import people
from rfgs_core.limbs.propose import (
    SMOOTH_S,
    Joints,
    combined,
    smoothed,
)
from rfgs_core.limbs.skins import PosedPeople, shapes_of
from rfgs_core.worlds.motion import random_motion

TIME_S = np.arange(9) * 0.1


def noisy(sigma_m: float, seed: int = 0) -> tuple[np.ndarray, Joints]:
    """One joint set on a parabola, and the same with noise."""
    rng = np.random.default_rng(seed)
    start, speed, bend = rng.normal(size=(3, 1, 17, 3))
    t = TIME_S[:, None, None, None]
    truth = start + speed * t + bend * t**2
    sigma = np.full(truth.shape[:3], sigma_m)
    return truth, Joints(truth + rng.normal(0.0, sigma_m, truth.shape), sigma)


def test_a_parabola_stays_what_it_is() -> None:
    truth, joints = noisy(0.0)
    np.testing.assert_allclose(smoothed(joints, TIME_S).xyz, truth, atol=1e-6)


def test_noise_is_averaged_and_outliers_with_a_large_sigma_are_ignored() -> None:
    truth, joints = noisy(0.05)
    before = np.linalg.norm(joints.xyz - truth, axis=-1).mean()
    after = np.linalg.norm(smoothed(joints, TIME_S).xyz - truth, axis=-1).mean()
    # Nine frames on three parameters: √(3/9) in the middle, less at the ends.
    assert after < 0.75 * before
    xyz, sigma = joints.xyz.copy(), joints.sigma_m.copy()
    xyz[4] += 3.0
    sigma[4] = 1e3
    told = smoothed(Joints(xyz, sigma), TIME_S).xyz
    assert np.linalg.norm(told - truth, axis=-1).mean() < before


def test_two_ways_together_are_nearer_than_either_and_say_how_near() -> None:
    rng = np.random.default_rng(3)
    truth, _ = noisy(0.0)
    sigmas = rng.uniform(0.02, 0.2, (2, *truth.shape[:3]))
    ways = [
        # σ is of a length in three dimensions.
        Joints(truth + rng.normal(size=truth.shape) * sigma[..., None] / np.sqrt(3.0), sigma)
        for sigma in sigmas
    ]
    both = combined(*ways)
    errors = [np.sqrt(np.mean((way.xyz - truth) ** 2)) for way in (*ways, both)]
    assert errors[2] < 0.8 * min(errors[:2])
    scaled = np.linalg.norm(both.xyz - truth, axis=-1) / both.sigma_m
    assert np.sqrt(np.mean(scaled**2)) == pytest.approx(1.0, abs=0.1)
    swapped = combined(*ways[::-1])
    np.testing.assert_allclose(swapped.xyz, both.xyz, atol=1e-12)
    # Who knows nothing has no say.
    blind = Joints(ways[1].xyz + 5.0, np.full_like(sigmas[1], 1e4))
    np.testing.assert_allclose(combined(ways[0], blind).xyz, ways[0].xyz, atol=1e-3)


def test_frames_far_apart_are_left_alone() -> None:
    _, joints = noisy(0.05)
    np.testing.assert_allclose(
        smoothed(joints, TIME_S * 10 * (SMOOTH_S + 0.1)).xyz, joints.xyz, atol=1e-6
    )


@pytest.fixture(scope="module")
def walk() -> tuple[Joints, np.ndarray]:
    """Joints of somebody else who walks, and who that is."""
    rng = np.random.default_rng(4)
    body = people().random(rng)
    motion = random_motion(rng, body, "walk")
    xyz = np.array([[body.joints17(motion.at(t))] for t in np.linspace(0.2, 1.0, 5)])
    return Joints(xyz, np.full(xyz.shape[:3], 0.03)), body.heads


def test_a_body_takes_the_poses_of_another(walk) -> None:
    joints, _ = walk
    posed = PosedPeople.through(joints, shapes_of(joints))
    error = np.linalg.norm(posed.joints17() - joints.xyz, axis=-1)
    assert error.mean() < 0.02 and error.max() < 0.08


def test_gaussians_keep_their_place_on_the_skin(walk) -> None:
    joints, _ = walk
    posed = PosedPeople.through(joints, shapes_of(joints))
    first, last = (posed.gaussians(frame, 500, seed=3) for frame in (0, 4))
    np.testing.assert_array_equal(first.bone, last.bone)
    assert (first.points != last.points).any()
    # A place on a shin stays as far from the knee as it was, whatever the leg does.
    body = posed.body(0)
    from rfgs_core.articulated import BONES

    shin = BONES.index("lowerleg_left")
    own = first.bone == shin
    assert own.any()
    gaps = [
        np.linalg.norm(drawn.points[own] - body.heads_at(posed.pose(frame, 0))[shin], axis=1)
        for frame, drawn in ((0, first), (4, last))
    ]
    assert np.median(np.abs(gaps[0] - gaps[1])) < 0.005
    np.testing.assert_allclose(np.linalg.norm(first.normals, axis=1), 1.0, atol=1e-6)
