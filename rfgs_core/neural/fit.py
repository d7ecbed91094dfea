# SPDX-License-Identifier: Apache-2.0
"""Fits a neural field to one frame, and reads it out as Gaussians with reflectivities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float64

from rfgs_core.adam import Adam
from rfgs_core.bodies.body_prior import Bodies, outward_normals
from rfgs_core.bodies.localise import pair_maps
from rfgs_core.bodies.posture import tell_postures
from rfgs_core.bodies.start import StartDensity
from rfgs_core.fit.frame import followed
from rfgs_core.fit.losses import SamplePoints
from rfgs_core.measure.observations import Observations
from rfgs_core.neural.fields import LogPrior, NeuralField
from rfgs_core.neural.objectives import FeatureTask, FieldTask, PropagationTask
from rfgs_core.neural.settings import FieldSettings
from rfgs_core.settings import TrainConfig

#: Adam's rate at the end, as a share of that at the start.
LAST_RATE = 0.1


@dataclass(frozen=True)
class StartPrior:
    """What RF-GS takes for likely of bodies before it fits anything."""

    bodies: Bodies
    """Where they are and how they hold themselves."""
    density: StartDensity
    """Where Gaussians would be drawn."""

    @staticmethod
    def of(observations: Observations, config: TrainConfig, seed: int) -> StartPrior:
        """Bodies found in a frame as RF-GS finds them.

        Raises:
            RfgsError: Nobody changes the channel.
        """
        tracks, maps = followed(None, observations, config, seed), pair_maps(observations)
        bodies = tell_postures(observations, maps, tracks.bodies, config, seed)
        return StartPrior(bodies, StartDensity.of(maps, bodies, observations.bounds_m))

    def log(self, points: Float64[np.ndarray, "N 3"]) -> Float64[np.ndarray, "N"]:
        """Logarithm of the density, zero where it is highest; −∞ where nothing would be drawn."""
        with np.errstate(divide="ignore"):
            return np.log(self.density.at(points) / self.density.share.max())


@dataclass(frozen=True)
class FittedField:
    """A field of one frame and what its score is made of."""

    field: NeuralField
    """The network."""
    task: FieldTask
    """What it was fitted to."""
    prior: StartPrior | None
    """What its density is multiplied by."""
    losses: list[float]
    """Loss of every step."""

    def score(self, points: Float64[np.ndarray, "N 3"], voxel_m: float) -> Float64[np.ndarray, "N"]:
        """Reflected power at voxel centres, the highest one; nothing outside of the prior."""
        values = self.field.everywhere(points, voxel_m / np.sqrt(12.0))
        log_prior = np.zeros(len(points)) if self.prior is None else self.prior.log(points)
        log_score = self.task.log_score(values, log_prior, voxel_m)
        return np.exp(log_score - log_score.max())

    def normals(
        self, points: Float[np.ndarray, "N 3"], step_m: float
    ) -> Float64[np.ndarray, "N 3"]:
        """Unit directions out of the bodies, or else down the slope of the density."""
        if self.prior is not None:
            return outward_normals(points, self.prior.bodies)
        slope = np.zeros_like(points)
        for axis in range(3):
            step = np.zeros(3)
            step[axis] = step_m
            before, after = (self.field.everywhere(points + s, step_m)[0] for s in (-step, step))
            slope[:, axis] = before - after
        return slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)


def fit_field(
    observations: Observations,
    settings: FieldSettings,
    config: TrainConfig,
    points: SamplePoints,
    prior: StartPrior | None = None,
    on_step: Callable[[float], None] | None = None,
) -> FittedField:
    """Fits a field to the visible channel of a frame.

    Args:
        observations: The frame.
        settings: Which field, and its fit.
        config: The grid of the sample points.
        points: Sample points of the objective `features`; the other one does not read them.
        prior: What the density is multiplied by where `settings.prior` asks for it; None is found
            here, as RF-GS finds it.
        on_step: Called with the loss of every step.

    Raises:
        RfgsError: Nobody changes the channel.
    """
    if not settings.prior:
        prior = None
    elif prior is None:
        prior = StartPrior.of(observations, config, settings.seed)
    field = NeuralField(settings, observations.bounds_m)
    task = _task(observations, settings, config, points, prior)
    return FittedField(field, task, prior, descend(field, task, settings, on_step))


def _task(
    observations: Observations,
    settings: FieldSettings,
    config: TrainConfig,
    points: SamplePoints,
    prior: StartPrior | None,
) -> FieldTask:
    log_prior: LogPrior | None = None if prior is None else prior.log
    if settings.objective == "features":
        side_m = float((observations.bounds_m[1] - observations.bounds_m[0]).max())
        cell_m = side_m / config.grid_side
        return FeatureTask(observations, points, cell_m / np.sqrt(12.0), settings, log_prior)
    density = None if prior is None else prior.density
    return PropagationTask(observations, settings, density, log_prior)


def descend(
    field: torch.nn.Module,
    task: FieldTask,
    settings: FieldSettings,
    on_step: Callable[[float], None] | None = None,
) -> list[float]:
    """Adam with a rate that falls evenly in its logarithm; the losses of all steps."""
    rate = settings.learning_rate
    optimiser = Adam.of(field.parameters(), rate, eps=1e-15)
    fall = LAST_RATE ** (1.0 / max(settings.steps, 1))
    losses = []
    for step in range(settings.steps):
        loss = task.loss(field, step)  # type: ignore[arg-type]
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        rate *= fall
        optimiser.set_rate(rate)
        losses.append(float(loss.detach()))
        if on_step is not None:
            on_step(losses[-1])
    return losses
