# SPDX-License-Identifier: Apache-2.0
"""The fit of one frame in stages: locate, settle, posture, draw, power, reflectivity, refine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Complex, Complex64, Float, Float64, Int64
from torch import Tensor

from rfgs_core.bodies.body_prior import outward_normals
from rfgs_core.bodies.count import place_bodies
from rfgs_core.bodies.gain import likelier_upright
from rfgs_core.bodies.likeliest_place import likeliest_peak, likeliest_places
from rfgs_core.bodies.localise import NEAR_M, PairMaps, in_order_of, locate_bodies, pair_maps
from rfgs_core.bodies.lying import with_lying
from rfgs_core.bodies.motion_density import novelty, speeds_m_s, wanted_counts
from rfgs_core.bodies.posture import tell_postures
from rfgs_core.bodies.separation import separated
from rfgs_core.bodies.start import StartCells
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.bodies.warm_start import Moving, carry_over, follow_motion
from rfgs_core.device import on_device
from rfgs_core.encode import MATCHED_FILTER, Encoder
from rfgs_core.errors import RfgsError
from rfgs_core.fit.sampling import encode
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.first_gaussians import gaussians_at, lone_gaussians
from rfgs_core.model.first_powers import level_of_power, new_head
from rfgs_core.model.head import RadioHead
from rfgs_core.model.reflectivity import fitted_reflectivities
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig


@dataclass(frozen=True)
class FrameState:
    """The moving Gaussians of one frame and what the next one starts from."""

    gaussians: Gaussians
    """Moving Gaussians."""
    power: Float[Tensor, "M"]
    """Reflected power of each, the prior variance of its reflectivity [m²]."""
    head: RadioHead
    """Decodes reflectivity and ρ from the features."""
    tracks: Tracks
    """Where the bodies are and how they move."""
    track_id: Int64[np.ndarray, "M"]
    """Number that a Gaussian keeps from frame to frame."""

    goes_on: Bool[np.ndarray, "M"] | None = None
    """Which Gaussians were there in the frame before; None in a first frame."""

    next_track: int = 0
    """Numbers below it were given out, some of them to Gaussians that are gone."""

    @property
    def unused_track(self) -> int:
        """The first number that no Gaussian has had."""
        return max(self.next_track, int(self.track_id.max(initial=-1)) + 1)

    @property
    def moving(self) -> Moving:
        """What the next frame starts from."""
        means = self.gaussians.means.numpy().astype(np.float64)
        power = self.power.numpy().astype(np.float64)
        return Moving(means, self.tracks.bodies, power, self.track_id, self.unused_track)

    @property
    def gamma(self) -> Complex[Tensor, "M"]:
        """Complex reflectivity of each Gaussian [m]."""
        return self.head.gamma(self.gaussians.features)


class OnSkins(NamedTuple):
    """Gaussians on the skins of posed people: where a frame starts whose limbs are told."""

    points: Float64[np.ndarray, "M 3"]
    """Where they are [m], row by row at the same place of the skin in every frame."""
    normals: Float64[np.ndarray, "M 3"]
    """How they face."""
    tracks: Tracks
    """Where the bodies are."""


def start_on_skins(
    observations: Observations,
    config: TrainConfig,
    skins: OnSkins,
    before: FrameState | None,
    encoder: Encoder = MATCHED_FILTER,
) -> FrameState:
    """Gaussians on the skins of posed people; a track is a place on the skin.

    Args:
        observations: The frame.
        config: Settings.
        skins: Where the Gaussians are.
        before: The fitted frame before, whose head goes on; None in a first one.
        encoder: φ.

    Raises:
        RfgsError: Nobody changes the channel.
    """
    _need_change(observations)
    head = None if before is None else before.head
    state = state_at(skins.points, skins.normals, observations, config, skins.tracks, encoder, head)
    goes_on = None if before is None else np.isin(state.track_id, before.track_id)
    return replace(state, goes_on=goes_on, next_track=len(skins.points))


def start_frame(
    observations: Observations,
    config: TrainConfig,
    seed: int,
    before: FrameState | None,
    encoder: Encoder = MATCHED_FILTER,
    earlier: Observations | None = None,
    *,
    settle: bool = True,
) -> FrameState:
    """Locates the bodies, tells how they hold themselves and draws Gaussians.

    From frame to frame all Gaussians move along with their body; the third that the new
    channel supports least is drawn anew and gets new track numbers, and so is whoever has sat
    down or stood up. With `--density motion` their number then follows the bodies' pace.

    Args:
        observations: The frame.
        config: Settings.
        seed: Seed of the draws.
        before: The fitted frame before; None in a first one.
        encoder: φ.
        earlier: What was observed then; only `--density motion` reads it.
        settle: Whether evidence moves the bodies from where the map shows them.

    Raises:
        RfgsError: Nobody changes the channel.
    """
    _need_change(observations)
    rng = np.random.default_rng(seed)
    maps = pair_maps(observations)
    known = None if before is None else before.tracks
    tracks = _followed(known, maps, observations, config, seed, settle)
    bodies = tell_postures(observations, maps, tracks.bodies, config, seed)
    tracks = replace(tracks, knees_rad=bodies.knees_rad)
    cells = StartCells.of(maps, bodies, observations.bounds_m)
    density = cells.density(bodies).even(bodies)
    points = density.draw(config.num_gaussians, rng)
    track_id, goes_on, next_track = np.arange(len(points), dtype=np.int64), None, 0
    if before is not None:
        points, track_id = carry_over(before.moving, bodies, cells, density, points, rng)
        if config.density == "motion" and earlier is not None:
            speed_m_s = speeds_m_s(tracks, novelty(observations, earlier))
            wanted = wanted_counts(config.num_gaussians, speed_m_s)
            points, track_id = follow_motion(
                before.moving, bodies, cells, wanted, points=points, track_id=track_id, rng=rng
            )
        goes_on, next_track = np.isin(track_id, before.track_id), before.unused_track
    head = None if before is None else before.head
    normals = outward_normals(points, bodies)
    state = state_at(points, normals, observations, config, tracks, encoder, head)
    return replace(state, track_id=track_id, goes_on=goes_on, next_track=next_track)


def start_anywhere(
    observations: Observations,
    config: TrainConfig,
    seed: int,
    before: FrameState | None,
    encoder: Encoder = MATCHED_FILTER,
) -> FrameState:
    """Gaussians anywhere in the bounds, as the paper starts: they know of no bodies.

    Nothing but the head goes on from frame to frame, and no track number is given twice. Each has
    the features of its place, as new ones have in section 3.5 of the paper.

    Args:
        observations: The frame.
        config: Settings.
        seed: Seed of the draw.
        before: The fitted frame before; None in a first one.
        encoder: φ.

    Raises:
        RfgsError: Nobody changes the channel.
    """
    _need_change(observations)
    low, high = observations.bounds_m
    points = np.random.default_rng(seed).uniform(low, high, (config.num_gaussians, 3))
    at = encode(observations, points, encoder)
    gaussians = lone_gaussians(at.xyz, at.features)
    power = level_of_power(observations, gaussians)
    head = new_head(observations, config, power) if before is None else before.head
    first = 0 if before is None else before.unused_track
    track_id = first + np.arange(len(points), dtype=np.int64)
    nobody = Tracks.begun(np.zeros((0, 2)), observations.time_s)
    return FrameState(gaussians, power, head, nobody, track_id, next_track=first + len(points))


def state_at(
    points: Float64[np.ndarray, "M 3"],
    normals: Float64[np.ndarray, "M 3"],
    observations: Observations,
    config: TrainConfig,
    tracks: Tracks,
    encoder: Encoder = MATCHED_FILTER,
    head: RadioHead | None = None,
) -> FrameState:
    """Gaussians at given places with their first powers, which reflect nothing yet.

    Args:
        points: Where they are [m].
        normals: How they face.
        observations: The frame.
        config: Settings.
        tracks: Where the bodies are.
        encoder: φ.
        head: The head of the frame before; None makes one.
    """
    gaussians = gaussians_at(points, normals)
    power = level_of_power(observations, gaussians)
    head = head or new_head(observations, config, power)
    features = head.without_readings(encode(observations, points, encoder).features)
    track_id = np.arange(len(points), dtype=np.int64)
    return FrameState(replace(gaussians, features=features), power, head, tracks, track_id)


def followed(
    before: Tracks | None, observations: Observations, config: TrainConfig, seed: int
) -> Tracks:
    """Finds the bodies of a frame, those of the frame before in the same order.

    Raises:
        RfgsError: Nobody changes the channel.
    """
    _need_change(observations)
    return _followed(before, pair_maps(observations), observations, config, seed, True)


def _need_change(observations: Observations) -> None:
    if not observations.changed:
        raise RfgsError(
            "the channel of this frame is that of the empty scene, or lost in noise: nobody is in "
            "it; choose other --frames, or generate the dataset with a larger --depth or more "
            "--packets-per-frame"
        )


def _followed(
    before: Tracks | None,
    maps: PairMaps,
    observations: Observations,
    config: TrainConfig,
    seed: int,
    settle: bool,
) -> Tracks:
    """Finds the bodies, anywhere in a first frame, where they are expected in a later one."""
    bounds_m, time_s = observations.bounds_m, observations.time_s
    several = config.bodies > 1 and observations.kind == "complex"
    placed = place_bodies(observations, config.bodies, config, seed) if several else None
    near, reach_m = (None, NEAR_M) if before is None else before.expected(time_s)
    if placed is not None:
        axes_xy = placed if near is None else in_order_of(near, placed)
    elif config.bodies == 1:
        axes_xy = likeliest_peak(observations, maps, near, reach_m)
    else:
        axes_xy = locate_bodies(maps, bounds_m, config.bodies, near, reach_m)
        axes_xy = separated(observations, maps, axes_xy, config, seed, near, reach_m)
    lay = None if before is None else before.bodies
    bodies = with_lying(observations, maps, axes_xy, config, seed, lay)
    if placed is not None:
        # What others leave of their echoes may look like somebody who lies.
        bodies = likelier_upright(observations, bodies, axes_xy)
    if settle:
        bodies = likeliest_places(observations, bodies, axes_xy)
    axes_xy = bodies.axes_xy
    tracks = Tracks.begun(axes_xy, time_s) if before is None else before.moved(axes_xy, time_s)
    return tracks.laid(bodies)


def solve_reflectivity(
    observations: Observations, state: FrameState, config: TrainConfig
) -> FrameState:
    """Writes posterior-mean reflectivities into the features.

    Powers per delay know nothing of phases: there each Gaussian gets the root of its reflected
    power and a phase drawn for it, the model that the power fit assumes.
    """
    there = on_device(state, config.device)
    gamma = fitted_reflectivities(
        observations,
        there.head,
        there.gaussians,
        there.power,
        unexplained=config.unexplained,
        iterations=config.solver_steps,
    )
    gamma = _drawn_phases(state, config.seed) if gamma is None else gamma.cpu()
    features = state.head.with_gamma(state.gaussians.features, gamma)
    return replace(state, gaussians=replace(state.gaussians, features=features))


def solved_frame(
    observations: Observations,
    config: TrainConfig,
    seed: int,
    before: FrameState | None = None,
    *,
    settle: bool = True,
) -> FrameState:
    """A started frame with its reflectivities, not refined; arguments as of `start_frame`."""
    state = start_frame(observations, config, seed, before, settle=settle)
    return solve_reflectivity(observations, state, config)


def explained_change(
    observations: Observations, state: FrameState
) -> Complex64[np.ndarray, "tx rx subcarrier"]:
    """What the Gaussians explain of the visible entries."""
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    with torch.no_grad():
        predicted = channel.change(state.head, state.gaussians)
    return observations.with_entries(predicted.numpy()).delta


def _drawn_phases(state: FrameState, seed: int) -> Complex[Tensor, "M"]:
    """√p with uniform phases; a track keeps its phase from frame to frame."""
    rng = np.random.default_rng(sub_seed(seed, "phase"))
    phase = torch.from_numpy(rng.uniform(0, 2 * np.pi, int(state.track_id.max()) + 1)).float()
    return torch.polar(state.power.sqrt(), phase[torch.from_numpy(state.track_id)])
