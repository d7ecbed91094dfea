# SPDX-License-Identifier: Apache-2.0
"""Several bodies separated: each is sought in what the others leave of the channel.

The map of one body has slopes on which the next one is lost, the more so the fewer hertz there
are. As in RELAX (Li and Stoica, IEEE Trans. Signal Process. 44(2), 1996) the echoes of all bodies
are fitted together, those of all but one are taken off, and that one is sought anew, in turn.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Complex64, Float64, Int64

from rfgs_core.bodies.body_prior import Bodies, nearest_axis, outward_normals
from rfgs_core.bodies.localise import NEAR_M, SEPARATION_M, PairMaps, locate_bodies, pair_maps
from rfgs_core.bodies.start import StartDensity
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import comparison_of
from rfgs_core.model.first_gaussians import gaussians_at
from rfgs_core.model.first_powers import fit_power, new_head, noise_per_link
from rfgs_core.model.reflectivity import posterior_mean
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig

#: Gaussians that stand for each body.
GAUSSIANS_PER_BODY = 1500
#: Conjugate-gradient steps of the fit of all echoes: of bodies that stand, and of posed ones, whose
#: skins are near enough to the true ones for it to be worth while.
SOLVER_STEPS, POSED_STEPS = 6, 40
#: Times that every body is sought anew.
ROUNDS = 2


def separated(
    observations: Observations,
    maps: PairMaps,
    axes_xy: Float64[np.ndarray, "body 2"],
    config: TrainConfig,
    seed: int,
    near: Float64[np.ndarray, "body 2"] | None = None,
    reach_m: Float64[np.ndarray, "body"] | float = NEAR_M,
) -> Float64[np.ndarray, "body 2"]:
    """Ground positions of bodies, better than those that were found in the map of all.

    Args:
        observations: The frame; without phases, or of one body, nothing is changed.
        maps: Its matched-filter maps.
        axes_xy: Where the bodies were found together [m].
        config: How reflectivities are fitted.
        seed: Seed of the Gaussians that stand for bodies.
        near: Where each body is expected [m]; None in a first frame, where all but the first
            are sought anew.
        reach_m: How far around to look [m].

    Returns:
        Positions [m], in the same order.
    """
    count = len(axes_xy)
    if count < 2 or observations.kind != "complex":
        return axes_xy
    found, reach_m = axes_xy.copy(), np.broadcast_to(reach_m, count)
    if near is None:
        for body in range(1, count):
            echoes = _echoes(observations, maps, Bodies.standing(found[:body]), config, seed)
            _move(found, body, _sought(observations, echoes.sum(axis=0)))
    for _ in range(ROUNDS):
        for body in range(count):
            echoes = _echoes(observations, maps, Bodies.standing(found), config, seed)
            others = echoes.sum(axis=0) - echoes[body]
            where = None if near is None else near[[body]]
            place = _sought(observations, others, where, reach_m[body])
            _move(found, body, place)
    return found


def each_alone(
    observations: Observations,
    maps: PairMaps,
    axes_xy: Float64[np.ndarray, "body 2"],
    config: TrainConfig,
    seed: int,
) -> list[Observations]:
    """The frame once for each body, without the echoes of all others."""
    if len(axes_xy) == 1:
        return [observations]
    echoes = _echoes(observations, maps, Bodies.standing(axes_xy), config, seed)
    others = echoes.sum(axis=0) - echoes
    return [_without(observations, part) for part in others]


def each_alone_posed(
    observations: Observations,
    points: Float64[np.ndarray, "M 3"],
    normals: Float64[np.ndarray, "M 3"],
    body: Int64[np.ndarray, "M"],
    count: int,
    config: TrainConfig,
) -> list[Observations]:
    """The frame once for each body, without the echoes of all others, whose poses are known.

    Args:
        observations: The frame.
        points: Places on the skins [m].
        normals: Where these face.
        body: Whose skin each is on, counted from 0.
        count: How many bodies there are.
        config: How reflectivities are fitted.
    """
    echoes = _echoes_of(observations, points, normals, body, count, config, POSED_STEPS)
    others = echoes.sum(axis=0) - echoes
    return [_without(observations, part) for part in others]


def residual_of_bodies(
    observations: Observations,
    maps: PairMaps,
    bodies: Bodies,
    config: TrainConfig,
    seed: int,
) -> Observations:
    """What remains of a frame without the echoes of all its bodies."""
    echoes = _echoes(observations, maps, bodies, config, seed)
    return _without(observations, echoes.sum(axis=0))


def _move(
    found: Float64[np.ndarray, "body 2"],
    body: int,
    place: Float64[np.ndarray, "1 2"],
) -> None:
    """Puts a body where it was sought, unless another one stands there."""
    others = np.delete(found, body, axis=0)
    if np.linalg.norm(others - place, axis=1).min() >= SEPARATION_M:
        found[body] = place[0]


def _sought(
    observations: Observations,
    echoes: Complex64[np.ndarray, "tx rx subcarrier"],
    near: Float64[np.ndarray, "1 2"] | None = None,
    reach_m: float = NEAR_M,
) -> Float64[np.ndarray, "1 2"]:
    """The loudest body of what remains without some echoes."""
    maps = pair_maps(_without(observations, echoes))
    return locate_bodies(maps, observations.bounds_m, 1, near, reach_m)


def _without(
    observations: Observations, echoes: Complex64[np.ndarray, "tx rx subcarrier"]
) -> Observations:
    """The frame less some echoes."""
    return observations.with_delta(observations.delta - echoes)


def _echoes(
    observations: Observations,
    maps: PairMaps,
    bodies: Bodies,
    config: TrainConfig,
    seed: int,
) -> Complex64[np.ndarray, "body tx rx subcarrier"]:
    """What each body reflects at the visible entries, all fitted together, shadows left aside."""
    rng = np.random.default_rng(sub_seed(seed, "apart"))
    density = StartDensity.of(maps, bodies, observations.bounds_m)
    points = density.draw(GAUSSIANS_PER_BODY * len(bodies), rng)
    body = nearest_axis(points, bodies.axes_xy)
    normals = outward_normals(points, bodies)
    return _echoes_of(observations, points, normals, body, len(bodies), config, SOLVER_STEPS)


def _echoes_of(
    observations: Observations,
    points: Float64[np.ndarray, "M 3"],
    normals: Float64[np.ndarray, "M 3"],
    body: Int64[np.ndarray, "M"],
    count: int,
    config: TrainConfig,
    steps: int,
) -> Complex64[np.ndarray, "body tx rx subcarrier"]:
    """The same by Gaussians at given places, facing given ways, each of one of `count` bodies."""
    gaussians = gaussians_at(points, normals)
    power = fit_power(observations, gaussians)
    head = new_head(observations, config, power)
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    target = comparison_of(observations).measured()
    noise = noise_per_link(observations, target, config.unexplained)
    gamma = posterior_mean(channel, head, gaussians, target, noise, power, steps)
    echoes = []
    with torch.no_grad():
        for index in range(count):
            own = torch.from_numpy(body == index)
            part = channel.scattered(head, gaussians.select(own), gamma[own])
            echoes.append(observations.with_entries(part.numpy()).delta)
    return np.stack(echoes)
