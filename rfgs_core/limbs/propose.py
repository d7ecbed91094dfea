# SPDX-License-Identifier: Apache-2.0
"""Joints of located people, frame by frame and smoothed over a sequence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Float64

from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M, body_maps, views_of
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.tokens import (
    MIRRORED,
    Packed,
    mirrored_joints,
    pack,
    relative_power,
    rotate,
    tokens,
)
from rfgs_core.measure.observations import Observations

#: Frames this far apart smooth each other [s], and the degree of the curve through them.
SMOOTH_S, DEGREE = 0.4, 2
#: Two ways contradict each other if the mean square of how far they are apart, in units of what
#: both are expected to be off, is more than this: 0.6 to 1.9 where a walk is right, and 4 to 11
#: where none is or the person is a child (random worlds and recorded motions).
_CONTRADICTION = 3.0
#: No joint is surer than this where joints are smoothed [m].
_SUREST_M = 0.01


class Joints(NamedTuple):
    """Where joints are."""

    xyz: Float64[np.ndarray, "*frame body 17 3"]
    """In the world [m]."""
    sigma_m: Float64[np.ndarray, "*frame body 17"]
    """How far each is expected to be off [m]."""


def propose(
    network: LimbNetwork, observations: Observations, axes_xy: Float[np.ndarray, "body 2"]
) -> Joints:
    """What the network makes of one frame.

    Every device pair's receiver gives the direction of the x axis once, with and without a
    mirror; what comes out is the mean.

    Args:
        network: The network of this kind of radio.
        observations: The frame.
        axes_xy: Where bodies are [m].
    """
    floor_m = float(observations.bounds_m[0, 2])
    views = views_of(observations.layout, observations.links)
    found, sigma = [], []
    for x, y in axes_xy:
        centre = np.array([x, y, floor_m + CENTRE_HEIGHT_M])
        maps = body_maps(
            observations.delta, observations.layout, observations.links,
            observations.freq_hz, observations.subcarriers, centre,
        )  # fmt: skip
        joints, sure = _asked(network, pack([(views, maps, centre)], len(views)))
        found.append(joints + centre)
        sigma.append(sure)
    return Joints(np.array(found).reshape(-1, 17, 3), np.array(sigma).reshape(-1, 17))


def _asked(
    network: LimbNetwork, packed: Packed
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Mean joints around the centre, and σ, of one packed frame."""
    pairs = np.flatnonzero(packed.there[0].numpy())
    receivers = packed.vectors[0, pairs, 1].numpy()
    # One reference per receiving device.
    _, first = np.unique(np.round(receivers, 3), axis=0, return_index=True)
    references = np.repeat(pairs[np.sort(first)], 2)
    many = Packed(*(values.repeat_interleave(len(references), 0) for values in packed))
    mirror = torch.arange(len(references)) % 2 == 1
    network.eval()
    with torch.no_grad():
        seen = tokens(many, relative_power(many), many.there, torch.from_numpy(references), mirror)
        joints, log_sigma = network(seen)
        straight = mirrored_joints(joints, mirror)
        sigma = torch.where(mirror[:, None], log_sigma[:, MIRRORED], log_sigma).exp()
        world = rotate(straight, seen.yaw)
    return world.mean(0).double().numpy(), sigma.mean(0).double().numpy()


def smoothed(joints: Joints, time_s: Float64[np.ndarray, "frame"]) -> Joints:
    """Each joint on a weighted quadratic through the frames around.

    Args:
        joints: Of all frames, shape (frame, body, 17, ·).
        time_s: Their times [s].

    Returns:
        The same. Errors of frames near each other are alike, so σ is their mean and no smaller.
    """
    xyz, sigma = joints.xyz.copy(), joints.sigma_m.copy()
    for frame in range(len(time_s)):
        near = np.flatnonzero(np.abs(time_s - time_s[frame]) <= SMOOTH_S + 1e-6)
        degree = min(DEGREE, len(near) - 1)
        powers = (time_s[near] - time_s[frame])[:, None] ** np.arange(degree + 1)
        weight = 1.0 / np.maximum(joints.sigma_m[near], _SUREST_M) ** 2
        normal = np.einsum("fi,fbj,fk->bjik", powers, weight, powers)
        moment = np.einsum("fi,fbj,fbjx->bjix", powers, weight, joints.xyz[near])
        inverse = np.linalg.inv(normal + 1e-9 * np.eye(degree + 1))
        xyz[frame] = np.einsum("bjk,bjkx->bjx", inverse[..., 0, :], moment)
        sigma[frame] = joints.sigma_m[near].mean(axis=0)
    return Joints(xyz, sigma)


def contradict(one: Joints, other: Joints) -> bool:
    """Whether two ways cannot both be right, for how far off they say that they are."""
    apart_m = np.linalg.norm(one.xyz - other.xyz, axis=-1)
    expected_m = np.hypot(one.sigma_m, other.sigma_m)
    return float(np.mean((apart_m / expected_m) ** 2)) > _CONTRADICTION


def of_walk_and_network(walk: Joints, network: Joints) -> Joints:
    """Joints told by evidence of a walk and by the network: of both, as long as they agree.

    Evidence finds the likeliest walk of a mean body on the floor, whoever it is; the network
    assumes neither. Where they contradict each other, it alone counts.
    """
    return network if contradict(walk, network) else combined(walk, network)


def combined(one: Joints, other: Joints) -> Joints:
    """Joints told in two ways whose errors have little to do with each other.

    Each way weighs 1/σ², as the product of two Gaussian densities does.
    """
    weights = [joints.sigma_m**-2.0 for joints in (one, other)]
    share = (weights[0] / (weights[0] + weights[1]))[..., None]
    return Joints(share * one.xyz + (1.0 - share) * other.xyz, sum(weights) ** -0.5)
