# SPDX-License-Identifier: Apache-2.0
"""Joints of located people, frame by frame and smoothed over a sequence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Float64

from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M, View, body_maps, views_of
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
#: Places around a body from which the network is asked [m].
_SIDES_M = 0.06 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
#: How often it is asked so, as long as the joints move by more than this [m].
_ROUNDS, _SETTLED_M = 3, 0.1
#: A filter of packets leaves holes where it heard noise, and the network has seen maps with noise:
#: noise that is put back, below each pair's peak, log10, how often each is drawn, and how sure the
#: network must be without any to be asked no more [m].
_PUT_BACK, _DRAWS, SURE_M = (-2.0, -1.5, -1.0), 4, 0.1
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
    """What the network makes of one frame, whoever else is in it.

    It is asked where a body is said to be, and then from four places around where it finds the
    joints, each time with the x axis towards another receiver, and with and without a mirror. What
    comes out is the mean of these four by 1/σ². Where that is elsewhere, as of somebody who lies,
    it is asked around there, up to three times. Where packets were filtered and it is unsure, so
    much noise is put back that it is surest.

    Args:
        network: The network of this kind of radio.
        observations: The frame.
        axes_xy: Where bodies are [m].
    """
    views = views_of(observations.layout, observations.links)
    said = [
        _asked_from(network, observations, views, place)
        for place in np.asarray(axes_xy, dtype=np.float64)
    ]
    return _of_bodies(said)


def glimpse(
    network: LimbNetwork,
    observations: Observations,
    axes_xy: Float[np.ndarray, "body 2"],
) -> Joints:
    """What the network makes of one of many windows that are averaged: it is asked but once.

    Args:
        network: The network of this kind of radio.
        observations: The window.
        axes_xy: Where bodies are [m].
    """
    views = views_of(observations.layout, observations.links)
    one = replace(observations, packets=None)
    said = [_asked_at(network, one, views, place, 0) for place in np.asarray(axes_xy, np.float64)]
    return _of_bodies(said)


def _of_bodies(
    said: list[tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]],
) -> Joints:
    """Joints and σ of some bodies, who may be none."""
    xyz, sigma = zip(*said, strict=True) if said else ((), ())
    return Joints(np.array(xyz).reshape(-1, 17, 3), np.array(sigma).reshape(-1, 17))


def _asked_from(
    network: LimbNetwork,
    observations: Observations,
    views: list[View],
    place_xy: Float64[np.ndarray, "2"],
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Joints in the world and σ, found from a place on."""
    joints, sure = _asked_at(network, observations, views, place_xy, 0)
    for _ in range(_ROUNDS):
        middle = joints[:, :2].mean(axis=0)
        joints, sure = _asked_around(network, observations, views, middle)
        if np.linalg.norm(joints[:, :2].mean(axis=0) - middle) < _SETTLED_M:
            break
    return joints, sure


def _asked_around(
    network: LimbNetwork,
    observations: Observations,
    views: list[View],
    middle_xy: Float64[np.ndarray, "2"],
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Mean joints in the world by 1/σ², and mean σ, from four places around a middle."""
    told = [
        _asked_at(network, observations, views, middle_xy + side, turn)
        for turn, side in enumerate(_SIDES_M)
    ]
    joints, sigma = (np.array(values) for values in zip(*told, strict=True))
    return _weighed(joints, sigma), sigma.mean(axis=0)


def _weighed(
    xyz: Float64[np.ndarray, "way *more 3"], sigma_m: Float64[np.ndarray, "way *more"]
) -> Float64[np.ndarray, "*more 3"]:
    """Mean over ways of which each weighs 1/σ²."""
    weight = sigma_m**-2.0
    return np.einsum("w...,w...x->...x", weight / weight.sum(axis=0), xyz)


def _asked_at(
    network: LimbNetwork,
    observations: Observations,
    views: list[View],
    place_xy: Float64[np.ndarray, "2"],
    turn: int,
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Joints in the world and σ, from maps around a place; see `_asked`."""
    floor_m = float(observations.bounds_m[0, 2])
    centre = np.array([*place_xy, floor_m + CENTRE_HEIGHT_M])
    maps = body_maps(
        observations.delta, observations.layout, observations.links,
        observations.freq_hz, observations.subcarriers, centre,
    )  # fmt: skip

    def said(maps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _asked(network, pack([(views, maps, centre)], len(views)), turn)

    filtered = observations.packets is not None
    joints, sigma = with_noise(said, maps) if filtered else said(maps)
    return joints + centre, sigma


def with_noise(
    said: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    maps: Float[np.ndarray, "pair elevation azimuth range"],
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Mean joints and σ at the level of noise, or none, at which the network is surest."""
    means = [said(maps)]
    if means[0][1].mean() < SURE_M:
        return means[0]
    rng = np.random.default_rng(0)
    peak = maps.max(axis=(1, 2, 3), keepdims=True)
    for level in _PUT_BACK:
        noise = peak * 10.0**level * rng.exponential(size=(_DRAWS, *maps.shape))
        joints, sigma = zip(
            *(said(each) for each in (maps + noise).astype(np.float32)), strict=True
        )
        means.append((np.mean(joints, axis=0), np.mean(sigma, axis=0)))
    return min(means, key=lambda mean: float(mean[1].mean()))


def _asked(
    network: LimbNetwork, packed: Packed, turn: int
) -> tuple[Float64[np.ndarray, "17 3"], Float64[np.ndarray, "17"]]:
    """Mean joints around the centre, and σ, of one packed frame as it is and in a mirror.

    Args:
        network: The network.
        packed: The frame.
        turn: Which of the receivers, counted around and around, gives the x axis.

    Returns:
        The centre, give or take a metre, where no pair hears anything.
    """
    pairs = np.flatnonzero(packed.there[0].numpy())
    if not len(pairs):
        return np.zeros((17, 3)), np.ones(17)
    receivers = packed.vectors[0, pairs, 1].numpy()
    _, first = np.unique(np.round(receivers, 3), axis=0, return_index=True)
    reference = torch.tensor(pairs[np.sort(first)][turn % len(first)]).repeat(2)
    both = Packed(*(values.repeat_interleave(2, 0) for values in packed))
    mirror = torch.tensor([False, True])
    network.eval()
    with torch.no_grad():
        seen = tokens(both, relative_power(both), both.there, reference, mirror)
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


def combined(one: Joints, other: Joints) -> Joints:
    """Joints told in two ways whose errors have little to do with each other.

    Each way weighs 1/σ², as the product of two Gaussian densities does.
    """
    xyz, sigma_m = np.stack([one.xyz, other.xyz]), np.stack([one.sigma_m, other.sigma_m])
    return Joints(_weighed(xyz, sigma_m), (sigma_m**-2.0).sum(axis=0) ** -0.5)
