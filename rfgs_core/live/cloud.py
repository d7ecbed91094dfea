# SPDX-License-Identifier: Apache-2.0
"""Moving Gaussians that follow a stream: one short step per window, from where they were.

A step looks for each body near where it is expected, by the matched filter; moves its Gaussians
along; and takes conjugate-gradient steps towards the reflectivities that explain the window. What a
body is like beside that comes from whole fits, which take seconds and run in a process of their own
(`whole_fit`); a step takes milliseconds. Where a network tells limbs (`limbs`), Gaussians lie on
posed skins instead, and whole fits only say whether somebody was lost.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float64

from rfgs_core.bodies.body_prior import Bodies, nearest_axis, outward_normals
from rfgs_core.bodies.localise import PairMaps, locate_bodies, pair_maps
from rfgs_core.bodies.start import StartDensity
from rfgs_core.bodies.tracks import FASTEST_M_S, REACH_M, Tracks
from rfgs_core.fit.frame import FrameState, solve_reflectivity, state_at
from rfgs_core.live.limbs import LiveLimbs
from rfgs_core.measure.observations import Observations
from rfgs_core.model.first_gaussians import quats_from_normals
from rfgs_core.radio import layout, place_devices, preset
from rfgs_core.settings import Observe, TrainConfig

#: Share of what a window corrects of the expected place, and of the velocity: an α–β filter
#: (Benedict and Bordner, IRE Trans. Automatic Control 7, 1962, β = α²/(2 − α)).
ALPHA = 0.3
BETA = ALPHA**2 / (2.0 - ALPHA)
#: Spacing of the maps [m]: within a device pair they are smooth.
_SPACING_M = 0.25
#: Windows that maps are averaged over, exponentially.
_WINDOWS = 3
#: A whole fit that finds a body this far from where it was followed says that it was lost [m].
LOST_M = 0.8
#: Places that are remembered, one per window.
_REMEMBERED = 1024


class Cloud:
    """The moving Gaussians of a stream."""

    def __init__(self, config: TrainConfig, seed: int = 0, limbs: LiveLimbs | None = None) -> None:
        """No Gaussians yet.

        Args:
            config: Number of Gaussians and bodies, kind of report, steps of the solver.
            seed: Seed of the draws.
            limbs: Tells how bodies hold themselves; None: they are moved as they were drawn.
        """
        self._limbs = limbs
        self.config = config
        self.state: FrameState | None = None
        self._rng = np.random.default_rng(seed)
        self._places: deque[Tracks] = deque(maxlen=_REMEMBERED)
        self._lost = False
        self._maps: PairMaps | None = None
        self._heard: list[tuple[int, int]] = []

    def update(self, observations: Observations) -> FrameState | None:
        """Follows a window; None while nothing changes the channel."""
        if not observations.changed:
            return self.state
        maps = self._averaged(observations)
        if self.state is None:
            self.state = self._begun(observations, maps)
        else:
            tracks = self._followed(self.state.tracks, observations, maps)
            self.state = self._carried(observations, tracks) or _moved(self.state, tracks)
        self._places.append(self.state.tracks)
        self.state = solve_reflectivity(observations, self.state, self.config)
        return self.state

    def take(self, fitted: FrameState) -> None:
        """Goes on with the Gaussians of a whole fit of an earlier window.

        Where that fit finds the bodies elsewhere than they were followed at that time, they are
        looked for anew, everywhere.
        """
        if self.state is None:
            return
        then = min(self._places, key=lambda each: abs(each.time_s - fitted.tracks.time_s))
        now = self.state.tracks
        apart = np.linalg.norm(fitted.tracks.axes_xy[:, None] - then.axes_xy, axis=2)
        nearest = apart.argmin(axis=1)
        self._lost |= bool((apart.min(axis=1) > LOST_M).any()) or len(set(nearest)) < len(nearest)
        if not self._lost and self._limbs is None:
            shift = now.axes_xy[nearest] - fitted.tracks.axes_xy
            body = nearest_axis(_means(fitted), fitted.tracks.axes_xy)
            self.state = replace(_shifted(fitted, shift[body]), tracks=now)

    def _begun(self, observations: Observations, maps: PairMaps) -> FrameState:
        """Bodies anywhere in the scene, drawn by prior and matched filter."""
        axes_xy = locate_bodies(maps, observations.bounds_m, self.config.bodies)
        still = _resting(axes_xy, observations.time_s)
        if self._limbs is not None:
            skins = self._limbs.on_skins(observations, still)
            return state_at(skins.points, skins.normals, observations, self.config, still)
        bodies = Bodies.standing(axes_xy)
        density = StartDensity.of(maps, bodies, observations.bounds_m).even(bodies)
        points = density.draw(self.config.num_gaussians, self._rng)
        normals = outward_normals(points, bodies)
        return state_at(points, normals, observations, self.config, still)

    def _carried(self, observations: Observations, tracks: Tracks) -> FrameState | None:
        """The same Gaussians on the skins of a window; None where nobody tells limbs."""
        if self._limbs is None or self.state is None:
            return None
        skins, gaussians = self._limbs.on_skins(observations, tracks), self.state.gaussians
        means = torch.from_numpy(skins.points).to(gaussians.means)
        quats = quats_from_normals(skins.normals).to(gaussians.quats)
        gaussians = replace(gaussians, means=means, quats=quats)
        return replace(self.state, gaussians=gaussians, tracks=tracks)

    def _followed(self, before: Tracks, observations: Observations, maps: PairMaps) -> Tracks:
        """Places and velocities of the bodies in a window."""
        time_s, bounds_m = observations.time_s, observations.bounds_m
        elapsed_s = max(time_s - before.time_s, 1e-3)
        if self._lost:
            self._lost = False
            axes_xy = locate_bodies(maps, bounds_m, self.config.bodies)
            return _resting(axes_xy, time_s)
        expected = before.axes_xy + elapsed_s * before.velocity_xy
        found = locate_bodies(maps, bounds_m, self.config.bodies, expected, REACH_M)
        wrong = found - expected
        velocity_xy = before.velocity_xy + BETA / elapsed_s * wrong
        speed = np.linalg.norm(velocity_xy, axis=1, keepdims=True)
        return replace(
            before,
            axes_xy=np.clip(expected + ALPHA * wrong, bounds_m[0, :2], bounds_m[1, :2]),
            velocity_xy=velocity_xy * np.minimum(1.0, FASTEST_M_S / np.maximum(speed, 1e-9)),
            time_s=time_s,
        )

    def _averaged(self, observations: Observations) -> PairMaps:
        """Maps of the last few windows: a body's speckle changes, its place hardly does."""
        now, heard = pair_maps(observations, _SPACING_M), observations.pairs[1]
        if self._maps is not None and self._heard == heard:
            now = replace(now, power=self._maps.power + (now.power - self._maps.power) / _WINDOWS)
        self._maps, self._heard = now, heard
        return now


def live_config(bodies: int, gaussians: int = 400, observe: Observe = "complex") -> TrainConfig:
    """Settings of a stream's short steps, and of the whole fits beside them."""
    return TrainConfig(
        bodies=bodies, num_gaussians=gaussians, observe=observe, solver_steps=2, iterations=20
    )


def warm_up(config: TrainConfig) -> None:
    """Loads everything that a step needs, so that the first one of a stream takes no longer.

    Args:
        config: Settings of the steps.
    """
    radio = preset("wifi_commodity")
    bounds_m = np.array([[0.0, 0.0, 0.0], [3.0, 3.0, 2.5]])
    elements = layout(radio, place_devices(radio, bounds_m))
    noise = np.random.default_rng(0).standard_normal((2, *elements.measured.shape, 1))
    values = np.repeat(noise[0] + 1j * noise[1], radio.num_subcarriers, axis=2)
    values = np.where(elements.measured[..., None], values, 0).astype(np.complex64)
    every = np.ones(radio.num_subcarriers, bool)
    observations = Observations(
        delta=1e-3 * values,
        static=values,
        links=elements.measured,
        subcarriers=every,
        layout=elements,
        freq_hz=radio.freq_hz,
        bounds_m=bounds_m,
        kind=config.observe,
    )
    cloud = Cloud(replace(config, bodies=1, num_gaussians=16))
    for time_s in (0.0, 0.04):
        cloud.update(replace(observations, time_s=time_s))


def _resting(axes_xy: Float64[np.ndarray, "body 2"], time_s: float) -> Tracks:
    """Tracks that begin, of bodies that are taken to rest."""
    return replace(Tracks.begun(axes_xy, time_s), velocity_xy=np.zeros_like(axes_xy))


def _means(state: FrameState) -> np.ndarray:
    return state.gaussians.means.numpy()


def _moved(state: FrameState, tracks: Tracks) -> FrameState:
    """The same Gaussians, each moved along with its body."""
    shift = tracks.axes_xy - state.tracks.axes_xy
    body = nearest_axis(_means(state), state.tracks.axes_xy)
    return replace(_shifted(state, shift[body]), tracks=tracks)


def _shifted(state: FrameState, shift: Float64[np.ndarray, "M 2"]) -> FrameState:
    """Gaussians moved over the ground."""
    means = state.gaussians.means.clone()
    means[:, :2] += torch.from_numpy(shift.astype(np.float32))
    return replace(state, gaussians=replace(state.gaussians, means=means))
