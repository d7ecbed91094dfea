# SPDX-License-Identifier: Apache-2.0
"""The fit of one frame, in named stages: locate, draw, power, reflectivity, refine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Complex, Float, Float64, Int64
from torch import Tensor

from rfgs_core.encode import MATCHED_FILTER, Encoder
from rfgs_core.errors import RfgsError
from rfgs_core.gaussians import Gaussians
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.seeds import sub_seed
from rfgs_core.train.channel import Channel
from rfgs_core.train.comparison import comparison_of
from rfgs_core.train.config import TrainConfig
from rfgs_core.train.delay_power import DelayPowerModel
from rfgs_core.train.density.motion import kept, novelty, paces_m_s, wanted_counts
from rfgs_core.train.head import SHARPNESS, RadioHead
from rfgs_core.train.localise import PairMaps, locate_bodies, pair_maps
from rfgs_core.train.observations import Observations
from rfgs_core.train.reflectivity import posterior_mean
from rfgs_core.train.sampling import encode
from rfgs_core.train.start import (
    START_SCALES_M,
    StartDensity,
    gaussians_at,
    nearest_axis,
    outward_normals,
)
from rfgs_core.train.tracks import Tracks

#: Multiplicative steps of the phase-free fit of reflected powers.
POWER_STEPS = 20


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

    @property
    def body(self) -> Int64[np.ndarray, "M"]:
        """Body that each Gaussian belongs to: the one whose axis is nearest."""
        means = self.gaussians.means.numpy().astype(np.float64)
        return nearest_axis(means, self.tracks.axes_xy)

    @property
    def gamma(self) -> Complex[Tensor, "M"]:
        """Complex reflectivity of each Gaussian [m]."""
        return self.head.gamma(self.gaussians.features)


def visibility(
    points: Float[np.ndarray, "M 3"], normals: Float[np.ndarray, "M 3"], model: DelayPowerModel
) -> Float[np.ndarray, "map M"]:
    """How much of a Gaussian each map's antennas see, by the propagation model's own rule."""
    rows = []
    for entry in model.maps:
        seen = np.ones(len(points))
        for antenna in (entry.tx_xyz.mean(axis=0), entry.rx_xyz.mean(axis=0)):
            towards = antenna - points
            towards /= np.linalg.norm(towards, axis=1, keepdims=True)
            seen /= 1 + np.exp(-SHARPNESS * np.sum(normals * towards, axis=1))
        # Squared: visibility scales the amplitude.
        rows.append(seen**2)
    return np.array(rows, dtype=np.float32)


def fit_power(
    observations: Observations, gaussians: Gaussians, config: TrainConfig
) -> Float[Tensor, "M"]:
    """Reflected powers from delay–angle maps: equal ones, unless the phase-free fit is trusted.

    The gain of each map against the model is fitted first: wall bounces and the neighbours of
    an antenna lift or lower whole device pairs.
    """
    points = gaussians.means.numpy().astype(np.float64)
    model = DelayPowerModel(observations, points)
    seen = visibility(points, gaussians.rotations[:, :, 2].numpy(), model)
    start = model.scaled(np.ones(len(points), dtype=np.float32), seen)
    gain = [
        data.sum() / max(float(model.expected(k, start * seen[k]).sum()), 1e-30)
        for k, (_, _, data) in enumerate(model.parts)
    ]
    seen = seen * np.array(gain, dtype=np.float32)[:, None]
    power = start
    for _ in range(POWER_STEPS if config.power_trust > 0 else 0):
        power = model.update(power, seen)
    ratio = np.maximum(power / start, 1e-6) ** config.power_trust
    # The level that suits the typical pair: the median keeps shadowed pairs out of it.
    return torch.from_numpy((start * ratio * np.median(gain)).astype(np.float32))


def noise_per_link(
    observations: Observations, target: Tensor, share: float
) -> Float[Tensor, "link"]:
    """Variance per link: a share of the mean power of its device pair."""
    pair, names = observations.pairs
    index = pair[observations.links]
    power = (target.abs() ** 2).mean(dim=1).numpy()
    mean = np.bincount(index, power, len(names)) / np.bincount(index, minlength=len(names))
    floor = 1e-3 * mean.max() if len(mean) else 0.0
    return torch.from_numpy((share * np.maximum(mean, floor * 1e-3))[index].astype(np.float32))


def new_head(
    observations: Observations, config: TrainConfig, power: Float[Tensor, "M"]
) -> RadioHead:
    """A head scaled so that typical reflectivities are features of about one."""
    wavelength_m = SPEED_OF_LIGHT / observations.centre_hz
    return RadioHead.create(
        sub_seed(config.seed, "head"),
        wavelength_m,
        START_SCALES_M[0],
        float(power.mean().sqrt().clamp(min=1e-9)),
    )


def start_frame(
    observations: Observations,
    config: TrainConfig,
    seed: int,
    before: FrameState | None,
    encoder: Encoder = MATCHED_FILTER,
    earlier: Observations | None = None,
) -> FrameState:
    """Locates the bodies and draws Gaussians; a later frame keeps the earlier one's.

    From frame to frame all Gaussians move along with their body; the third that the new
    channel supports least is drawn anew and gets new track numbers. With `--density motion` their
    number then follows the bodies' pace.

    Args:
        observations: The frame.
        config: Settings.
        seed: Seed of the draws.
        before: The fitted frame before; None in a first one.
        encoder: φ.
        earlier: What was observed then; only `--density motion` reads it.

    Raises:
        RfgsError: Nobody changes the channel.
    """
    if not observations.changed:
        raise RfgsError(
            "the channel of this frame is that of the empty scene, or lost in noise: nobody is in "
            "it; choose other --frames, or generate the dataset with a larger --depth or more "
            "--packets-per-frame"
        )
    rng = np.random.default_rng(seed)
    maps = pair_maps(observations)
    tracks = _followed(before, maps, observations, config.bodies)
    axes_xy = tracks.axes_xy
    density = StartDensity.of(maps, axes_xy, observations.bounds_m)
    points = density.draw(config.num_gaussians, rng)
    track_id, goes_on = np.arange(len(points), dtype=np.int64), None
    if before is not None:
        points, track_id = _carry_over(before, density, axes_xy, points)
        if config.density == "motion" and earlier is not None:
            wanted = wanted_counts(
                config.num_gaussians, paces_m_s(tracks, novelty(observations, earlier))
            )

            def draw(body: int, count: int) -> Float64[np.ndarray, "count 3"]:
                own = axes_xy[body : body + 1]
                return StartDensity.of(maps, own, observations.bounds_m).draw(count, rng)

            points, track_id = _at_pace(before, axes_xy, wanted, points, track_id, draw)
        goes_on = np.isin(track_id, before.track_id)
    gaussians = gaussians_at(points, outward_normals(points, axes_xy))
    power = fit_power(observations, gaussians, config)
    head = before.head if before is not None else new_head(observations, config, power)
    features = head.without_readings(encode(observations, points, encoder).features)
    gaussians = replace(gaussians, features=features)
    return FrameState(gaussians, power, head, tracks, track_id, goes_on)


def _followed(
    before: FrameState | None, maps: PairMaps, observations: Observations, bodies: int
) -> Tracks:
    """Finds the bodies, anywhere in a first frame, where they are expected in a later one."""
    bounds_m, time_s = observations.bounds_m, observations.time_s
    if before is None:
        return Tracks.begun(locate_bodies(maps, bounds_m, bodies), time_s)
    near, reach_m = before.tracks.expected(time_s)
    return before.tracks.moved(locate_bodies(maps, bounds_m, bodies, near, reach_m), time_s)


def _carry_over(
    before: FrameState,
    density: StartDensity,
    axes_xy: Float64[np.ndarray, "body 2"],
    fresh: Float64[np.ndarray, "M 3"],
) -> tuple[Float64[np.ndarray, "M 3"], Int64[np.ndarray, "M"]]:
    """Moves the earlier Gaussians with their bodies; the least supported third is fresh."""
    points = before.gaussians.means.numpy().astype(np.float64)
    points[:, :2] += (axes_xy - before.tracks.axes_xy)[before.body]
    count = min(len(points) // 3, len(fresh))
    weakest = np.argsort(density.at(points))[:count]
    track_id = before.track_id.copy()
    points[weakest] = fresh[:count]
    track_id[weakest] = track_id.max() + 1 + np.arange(count)
    return points, track_id


def _at_pace(
    before: FrameState,
    axes_xy: Float64[np.ndarray, "body 2"],
    wanted: Int64[np.ndarray, "body"],
    points: Float64[np.ndarray, "M 3"],
    track_id: Int64[np.ndarray, "M"],
    draw: Callable[[int, int], np.ndarray],
) -> tuple[Float64[np.ndarray, "N 3"], Int64[np.ndarray, "N"]]:
    """Drops each body's weakest Gaussians, or draws some, until there are as many as wanted."""
    # What came anew has not reflected anything yet.
    power = np.where(np.isin(track_id, before.track_id), before.power.numpy(), 0.0)
    keep = kept(nearest_axis(points, axes_xy), power, wanted)
    points, track_id = points[keep], track_id[keep]
    have = np.bincount(nearest_axis(points, axes_xy), minlength=len(wanted))
    more = [draw(body, int(count)) for body, count in enumerate(wanted - have) if count > 0]
    points = np.concatenate([points, *more])
    unused = max(track_id.max(initial=-1), before.track_id.max()) + 1
    fresh = unused + np.arange(len(points) - len(track_id))
    return points, np.concatenate([track_id, fresh])


def solve_reflectivity(
    observations: Observations, state: FrameState, config: TrainConfig
) -> FrameState:
    """Writes posterior-mean reflectivities into the features.

    Powers per delay know nothing of phases: there each Gaussian gets the root of its reflected
    power and a phase drawn for it, the model that the power fit assumes.
    """
    comparison = comparison_of(observations)
    channel = Channel.of(observations, observations.links, observations.tones)
    with torch.no_grad():
        shadow = comparison.linear(channel.shadowed(state.head, state.gaussians))
    if shadow is None:
        gamma = _drawn_phases(state, config.seed)
    else:
        measured = comparison.measured()
        noise = noise_per_link(observations, measured, config.unexplained)
        gamma = posterior_mean(
            *(channel, state.head, state.gaussians, measured - shadow, noise, state.power),
            *(config.solver_steps, comparison),
        )
    features = state.head.with_gamma(state.gaussians.features, gamma)
    return replace(state, gaussians=replace(state.gaussians, features=features))


def _drawn_phases(state: FrameState, seed: int) -> Complex[Tensor, "M"]:
    """√p with uniform phases; a track keeps its phase from frame to frame."""
    rng = np.random.default_rng(sub_seed(seed, "phase"))
    phase = torch.from_numpy(rng.uniform(0, 2 * np.pi, int(state.track_id.max()) + 1)).float()
    return torch.polar(state.power.sqrt(), phase[torch.from_numpy(state.track_id)])
