# SPDX-License-Identifier: Apache-2.0
"""Gradient descent on the Gaussians of one frame: the paper's losses, the channel's, or both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from rfgs_core.arrays import Shape, load_arrays, save_arrays
from rfgs_core.device import on_device
from rfgs_core.encode import MATCHED_FILTER, Encoder
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.fit.density import (
    DensityControl,
    DensityRule,
    NoDensity,
    PaperDensity,
    ResidualDensity,
    ResidualRule,
    StandardDensity,
    StandardRule,
)
from rfgs_core.fit.frame import FrameState
from rfgs_core.fit.last_finite import LastFinite
from rfgs_core.fit.parameters import (
    GAUSSIAN_SHAPES,
    MOMENTS,
    LearningRates,
    TrainableGaussians,
)
from rfgs_core.fit.task import Task, batch, loss_of
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: Our rates for the channel loss: positions move by fractions of a wavelength.
CHANNEL_RATES = LearningRates(
    means=5e-4, log_scales=2e-3, quats=1e-3, features=1e-2, logit_opacities=2e-2
)
#: So many Gaussians these rates suit.
_SUITED = 6000
#: Adam steps between checkpoints within a frame.
CHECKPOINT_EVERY = 1000
#: What a checkpoint may hold beside the Gaussians: Adam's moments, and what densities remember.
_MEMORY: dict[str, Shape] = {
    **{f"{name}.{key}": shape for name, shape in GAUSSIAN_SHAPES.items() for key in MOMENTS},
    **{f"{name}.step": () for name in GAUSSIAN_SHAPES},
    **dict.fromkeys(("density.error_sum", "density.error_count"), ("window",)),
    "density.gradient_sum": ("gradients",),
    "density.gradient_steps": (),
}


def refine(
    observations: Observations,
    state: FrameState,
    config: TrainConfig,
    seed: int,
    checkpoint: Path | None = None,
    on_step: Callable[[float, int], None] | None = None,
    encoder: Encoder = MATCHED_FILTER,
    scalars: Callable[[int, Mapping[str, float]], None] | None = None,
) -> FrameState:
    """Descends the objective of `config` for `config.iterations` steps.

    Args:
        observations: Visible channel of the frame.
        state: Where to start.
        config: Objective, steps and batch sizes.
        seed: Seed of batches and line points.
        checkpoint: File to resume from and to save to; None keeps nothing.
        on_step: Called with loss and number of Gaussians after each step.
        encoder: φ of the sample points.
        scalars: Takes the finished steps and values to log.

    Raises:
        RfgsError: The loss is not a number; the last good state is then in `checkpoint`.
    """
    task = Task.of(observations, config, seed, encoder).on(config.device)
    before, state = state, on_device(state, config.device)
    paper = config.recipe == "paper"
    rates = LearningRates() if paper else channel_rates(len(state.gaussians))
    trained, first, memory = _resume(checkpoint, state.gaussians, rates)
    density = density_control(observations, state, config, seed, task)
    density.resume(memory)
    last_finite, continuity = LastFinite(checkpoint), _continuity(state, config)
    for step in range(first + 1, config.iterations + 1):
        links, chosen = batch(task, config, seed, step)
        links = links if config.objective != "paper" else links[:0]
        points = None if task.points is None else task.points.rows(chosen)
        loss = loss_of(task, state, trained.gaussians, links, points)
        if continuity is not None:
            loss = loss + continuity.loss(trained.gaussians, trained.origin)
        if not torch.isfinite(loss):
            last_finite.stop(step, loss, task.target, trained)
        last_finite.remember(partial(_arrays, step - 1, trained, density))
        trained.optimiser.zero_grad()
        loss.backward()
        trained.optimiser.step()
        density.after_step(step, trained, points)
        if checkpoint is not None and step % CHECKPOINT_EVERY == 0:
            save_arrays(checkpoint, _arrays(step, trained, density))
        if scalars is not None:
            scalars(step, {"loss": float(loss.detach()), "Gaussians": len(trained.gaussians)})
        if on_step is not None:
            on_step(float(loss.detach()), len(trained.gaussians))
    return _with_gaussians(before, trained, config)


def channel_rates(count: int) -> LearningRates:
    """Rates for the channel loss of so many Gaussians.

    Of M that reflect a given power together, each has an amplitude of 1/√M, and Adam's first steps
    move the features of all alike: their sum changes by √M times the rate.
    """
    slower = min(1.0, (_SUITED / max(count, 1)) ** 0.5)
    return replace(CHANNEL_RATES, features=CHANNEL_RATES.features * slower)


def _continuity(state: FrameState, config: TrainConfig) -> Continuity | None:
    if state.goes_on is None or config.temporal == 0.0:
        return None
    means = state.gaussians.means.detach().clone()
    goes_on = torch.from_numpy(state.goes_on).to(means.device)
    return Continuity(means, goes_on, config.temporal)


def need_sample_points(config: TrainConfig) -> None:
    """Refuses the paper's density rule where nothing gives it sample points.

    Raises:
        RfgsError: It is asked for without the paper's losses.
    """
    if config.density == "paper" and config.objective == "csi":
        raise RfgsError(
            "--density paper reads the sample points of the paper's losses; expected "
            "--objective paper or both, or another --density"
        )


def density_control(
    observations: Observations, state: FrameState, config: TrainConfig, seed: int, task: Task
) -> DensityControl:
    """The density control of the settings.

    Raises:
        RfgsError: The paper's rule is asked for without the paper's losses.
    """
    need_sample_points(config)
    kind = config.density or ("none" if task.points is None else "paper")
    if kind == "paper":
        assert task.points is not None
        return PaperDensity(DensityRule.without(config.without), task.points)
    if kind == "3dgs":
        layout = observations.layout
        antennas = np.concatenate([layout.tx_xyz, layout.rx_xyz])
        radius_m = np.linalg.norm(antennas - antennas.mean(axis=0), axis=1).max()
        return StandardDensity(StandardRule.for_steps(config.iterations), 1.1 * radius_m, seed)
    if kind == "residual":
        return ResidualDensity(
            rule=ResidualRule(),
            observations=observations,
            channel=task.channel,
            comparison=task.comparison,
            noise=task.noise,
            head=state.head,
            bodies=state.tracks.bodies,
            iterations=config.iterations,
        )
    return NoDensity()


def _arrays(
    step: int, trained: TrainableGaussians, density: DensityControl
) -> dict[str, np.ndarray]:
    """All that resuming after `step` steps needs."""
    memory = {f"density.{name}": value for name, value in density.state().items()}
    return {**trained.state(), **memory, "finished_steps": np.array(step)}


def _resume(
    checkpoint: Path | None, start: Gaussians, rates: LearningRates
) -> tuple[TrainableGaussians, int, dict[str, Tensor]]:
    if checkpoint is None or not checkpoint.exists():
        return TrainableGaussians(start, rates), 0, {}
    arrays = load_arrays(
        checkpoint,
        "delete it to start this frame over",
        {**GAUSSIAN_SHAPES, "edited": (), "origin": ("M",), "finished_steps": ()},
        types={
            **dict.fromkeys((*GAUSSIAN_SHAPES, *_MEMORY), "f4"),
            **dict.fromkeys(("origin", "finished_steps", "density.gradient_steps"), "i8"),
            "edited": "?",
        },
        optional=_MEMORY,
    )
    origin, steps = arrays["origin"], int(arrays["finished_steps"])
    if steps < 0 or ((origin < -1) | (origin >= len(start))).any():
        raise RfgsFormatError(
            f"{checkpoint}: of other Gaussians than this frame's; delete it to start it over"
        )
    prefix, device = "density.", start.means.device
    memory = {
        name.removeprefix(prefix): torch.from_numpy(value.copy()).to(device)
        for name, value in arrays.items()
        if name.startswith(prefix)
    }
    try:
        return TrainableGaussians.restore(arrays, rates, device), steps, memory
    except RfgsFormatError as error:
        raise RfgsFormatError(f"{checkpoint}: {error}") from error


def _with_gaussians(
    state: FrameState, trained: TrainableGaussians, config: TrainConfig
) -> FrameState:
    """The state with the trained Gaussians; what came anew has its own power and track.

    With the paper's objective features are no reflectivities: powers are shared by α ‖f‖², whether
    rows have come or gone or not, and together stay what the start explained the channel with.
    """
    gaussians = on_device(trained.gaussians.detach(), state.gaussians.means.device)
    if config.objective == "paper":
        strength = torch.linalg.norm(gaussians.features, dim=1) ** 2 * gaussians.opacities
        share = strength / strength.sum().clamp(min=1e-30)
        state = replace(state, power=share * state.power.sum())
    if not trained.edited:
        return replace(state, gaussians=gaussians)
    origin = trained.origin.to(gaussians.means.device)
    unused = state.unused_track
    tracks = {"track_id": _tracks(state.track_id, origin.numpy(), unused), "next_track": unused}
    if config.objective == "paper":
        return replace(state, gaussians=gaussians, **tracks)
    known = origin >= 0
    shares = torch.bincount(origin[known], minlength=len(state.power)).clamp(min=1)
    inherited = (state.power / shares)[origin.clamp(min=0)]
    power = torch.where(known, inherited, state.head.gamma(gaussians.features).abs() ** 2)
    return replace(state, gaussians=gaussians, power=power, **tracks)


def _tracks(
    before: Int64[np.ndarray, "start"], origin: Int64[np.ndarray, "M"], unused: int
) -> Int64[np.ndarray, "M"]:
    """Track numbers of rows: the first that stems from an earlier one goes on, others are new."""
    track_id = np.full(len(origin), -1, dtype=np.int64)
    earlier, first = np.unique(origin, return_index=True)
    track_id[first[earlier >= 0]] = before[earlier[earlier >= 0]]
    fresh = track_id < 0
    track_id[fresh] = unused + np.arange(int(fresh.sum()))
    return track_id


#: Step of a limb against its trunk that costs as much as the whole channel error of a link [m].
STEP_M = 0.05


@dataclass(frozen=True)
class Continuity:
    """Keeps Gaussians where they were on their body from frame to frame (paper section 4.7).

    A frame starts from the earlier Gaussians, moved along with their bodies. The term pulls those
    that go on towards that start, in units of what a limb moves against the trunk between frames;
    Gaussians that came anew are free.
    """

    expected: Float[Tensor, "start 3"]
    """Positions at the start of the frame [m]."""
    goes_on: Bool[Tensor, "start"]
    """Which of them were there in the frame before."""
    weight: float
    """Weight of the term beside the channel's loss."""

    def loss(self, gaussians: Gaussians, origin: Int64[Tensor, "M"]) -> Float[Tensor, ""]:
        """Mean squared step away from the start, in units of `STEP_M`.

        Args:
            gaussians: Present Gaussians.
            origin: Row at the start that each one is or stems from; −1: none.
        """
        rows = torch.nonzero((origin >= 0) & self.goes_on[origin.clamp(min=0)])[:, 0]
        if not len(rows):
            return gaussians.means.new_zeros(())
        step = (gaussians.means[rows] - self.expected[origin[rows]]) / STEP_M
        return self.weight * torch.mean(torch.sum(step**2, dim=1))
