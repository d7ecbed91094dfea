# SPDX-License-Identifier: Apache-2.0
"""Evidence of a walk and the network, together as far as they agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.articulated import Pose, people
from rfgs_core.limbs.propose import Joints, combined
from rfgs_core.limbs.skins import sized
from rfgs_core.limbs.together import contradiction, walk_with_network
from rfgs_core.measure.observations import Observations
from rfgs_core.worlds.motion import random_motion

#: Shape of the mean body.
MEAN = np.zeros((1, len(people().components)))


@pytest.fixture
def seen(make_observations: Callable[..., Observations]) -> list[Observations]:
    return [make_observations()]


def of_mean_size(walk: Joints, network: Joints, seen: list[Observations]) -> Joints:
    """What both tell of somebody whom the network says to be as tall as walks are."""
    return walk_with_network(walk, network, MEAN, seen)


def test_a_walk_that_the_network_contradicts_has_no_say(seen: list[Observations]) -> None:
    """They agree as long as they are apart by less than √3 of what both are expected to be off."""
    walk = Joints(np.zeros((4, 1, 17, 3)), np.full((4, 1, 17), 0.06))
    for share, apart in ((0.98, False), (1.02, True)):
        # Half of the joints are right, the other half are off by enough for all of them.
        off = np.zeros((4, 1, 17, 3))
        off[:, :, ::2, 1] = share * np.sqrt(3.0 * 17 / 9) * np.hypot(0.06, 0.15)
        network = Joints(off, np.full((4, 1, 17), 0.15))
        assert ((contradiction(walk, network) > 3.0) == apart).all()
        told = of_mean_size(walk, network, seen)
        assert np.array_equal(told.xyz, network.xyz) == apart
        assert np.array_equal(told.sigma_m, network.sigma_m) == apart


def test_a_walk_far_from_the_network_counts_as_if_it_had_said_so(
    seen: list[Observations],
) -> None:
    """Joints √½ of what both are expected to be off apart leave the walk as sure as it says.

    Further apart, it has the σ that brings them there.
    """
    network = Joints(np.zeros((3, 1, 17, 3)), np.full((3, 1, 17), 0.04))
    for sigma_m in (0.05, 0.08, 0.2):
        off = np.zeros((3, 1, 17, 3))
        off[..., 0] = np.sqrt(0.5) * np.hypot(sigma_m, 0.04)
        right = Joints(off, np.full((3, 1, 17), sigma_m))
        proud = Joints(off, np.full((3, 1, 17), 0.05))
        if (contradiction(proud, network) > 3.0).any():
            # Too far to be of the same person: the network alone counts.
            told = of_mean_size(proud, network, seen)
            np.testing.assert_array_equal(told.xyz, network.xyz)
            continue
        wanted, told = combined(right, network), of_mean_size(proud, network, seen)
        np.testing.assert_allclose(told.xyz, wanted.xyz, atol=1e-6)
        np.testing.assert_allclose(told.sigma_m, wanted.sigma_m, rtol=1e-5)


def test_whether_they_agree_is_asked_before_the_walk_is_as_tall_as_the_network_says(
    seen: list[Observations],
) -> None:
    """Somebody small who squats is nearer to a walk of a small body than to one of a mean body."""
    body = people().body(np.zeros(0))
    small = MEAN.copy()
    small[0, 0] = -2.0
    floor_m = float(seen[0].bounds_m[0, 2])
    upright = body.joints17(Pose(body.heads[0], body.neutral))
    upright[:, 2] += floor_m
    walk = Joints(np.tile(upright, (4, 1, 1, 1)), np.full((4, 1, 17), 0.07))
    own = sized(walk, small, floor_m)
    network = Joints(own.xyz - [0.06, 0.0, 0.08], np.full((4, 1, 17), 0.07))
    assert (contradiction(walk, network) > 3.0).all() and (contradiction(own, network) < 3.0).all()
    told = walk_with_network(walk, network, small, seen)
    np.testing.assert_array_equal(told.xyz, network.xyz)


def test_beside_others_or_of_filtered_packets_a_walk_does_not_take_the_size_of_the_network(
    heard_by_radars: tuple[Observations, np.ndarray],
) -> None:
    observations, joints = heard_by_radars
    walk = Joints(joints[None, None], np.full((1, 1, 17), 0.06))
    network = Joints(walk.xyz + 0.04, np.full((1, 1, 17), 0.05))
    small = MEAN.copy()
    small[0, 0] = -2.0
    floor_m = float(observations.bounds_m[0, 2])
    own = sized(walk, small, floor_m)
    told, plain = walk_with_network(walk, network, small, [observations]), combined(own, network)
    # Doubted, it has less weight than its own σ gives it, and is as tall as the network says.
    far, near = (np.abs(one.xyz - network.xyz).max() for one in (plain, told))
    assert 0.0 < near < far and (told.sigma_m > plain.sigma_m).all()
    assert np.abs(np.cross(told.xyz - network.xyz, own.xyz - network.xyz)).max() < 1e-9
    beside = walk_with_network(walk, network, small, [observations], others=True)
    np.testing.assert_array_equal(beside.xyz, combined(walk, network).xyz)
    np.testing.assert_array_equal(beside.sigma_m, combined(walk, network).sigma_m)
    filtered = replace(observations, packets=np.stack([observations.delta] * 2))
    told = walk_with_network(walk, network, small, [observations, filtered])
    np.testing.assert_array_equal(told.xyz, combined(walk, network).xyz)


def test_a_frame_that_the_network_turns_around_is_left_to_the_walk(
    seen: list[Observations],
) -> None:
    rng = np.random.default_rng(5)
    walk = Joints(rng.normal(size=(6, 1, 17, 3)) * 0.1, np.full((6, 1, 17), 0.07))
    said = walk.xyz + 0.02
    said[2, ..., :2] *= -1.0
    network = Joints(said, np.full((6, 1, 17), 0.07))
    told, both = of_mean_size(walk, network, seen), combined(walk, network)
    np.testing.assert_allclose(told.xyz[2], walk.xyz[2], atol=1e-12)
    np.testing.assert_array_equal(told.sigma_m[2], walk.sigma_m[2])
    others = [0, 1, 3, 4, 5]
    np.testing.assert_allclose(told.xyz[others], both.xyz[others], atol=1e-12)
    np.testing.assert_array_equal(told.sigma_m[others], both.sigma_m[others])


@pytest.mark.parametrize("floor_m", [0.0, -1.2])
def test_a_walk_of_the_mean_body_fits_a_small_one_once_it_is_sized(floor_m: float) -> None:
    """Joints of the same poses; what is left are proportions and the length of steps."""
    small = np.array([-2.0, 0.0, 0.0])
    mean, own = people().body(np.zeros(0)), people().body(small)
    assert own.height_m < 0.95 * mean.height_m
    motion = random_motion(np.random.default_rng(4), mean, "walk")
    poses = [motion.at(t) for t in np.linspace(0.2, 1.0, 5)]
    place = np.array([0.7, -0.4, floor_m])
    walk = np.array([[mean.joints17(pose) + place] for pose in poses])
    told = sized(Joints(walk, np.full(walk.shape[:3], 0.06)), small[None], floor_m)
    ground = walk[:, :, :1, :2]
    np.testing.assert_allclose(told.xyz[:, :, 0, :2], ground[:, :, 0], atol=1e-12)
    ratio = own.height_m / mean.height_m
    np.testing.assert_allclose(told.xyz[..., 2] - floor_m, ratio * (walk[..., 2] - floor_m))
    limbs = [np.linalg.norm(told.xyz[..., a, :] - told.xyz[..., b, :]) for a, b in ((1, 2), (2, 3))]
    long = [np.linalg.norm(walk[..., a, :] - walk[..., b, :]) for a, b in ((1, 2), (2, 3))]
    np.testing.assert_allclose(np.array(limbs) / long, ratio)
    mean_shape = sized(told, np.zeros((1, 3)), floor_m)
    np.testing.assert_allclose(mean_shape.xyz, told.xyz)
