# SPDX-License-Identifier: Apache-2.0
"""From a started frame to a fitted one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from rfgs_core.encode import MATCHED_FILTER, Encoder
from rfgs_core.fit.frame import FrameState, solve_reflectivity
from rfgs_core.fit.refine import refine
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig


def fit_frame(
    observations: Observations,
    start: FrameState,
    config: TrainConfig,
    seed: int,
    *,
    encoder: Encoder = MATCHED_FILTER,
    checkpoint: Path | None = None,
    on_solved: Callable[[], None] | None = None,
    on_step: Callable[[float, int], None] | None = None,
    scalars: Callable[[int, Mapping[str, float]], None] | None = None,
) -> FrameState:
    """Solves the reflectivities and refines; with the paper's objective they are solved last.

    Args:
        observations: Visible channel of the frame.
        start: Where its Gaussians start, as `start_frame` or `state_at` give it.
        config: Settings.
        seed: Seed of batches and line points.
        encoder: φ of the sample points.
        checkpoint: File to resume the refinement from and to save it to; None keeps nothing.
        on_solved: Called before the refinement.
        on_step: Called with loss and number of Gaussians after each of its steps.
        scalars: Takes its finished steps and values to log.

    Raises:
        RfgsError: The loss is not a number; the last good state is then in `checkpoint`.
    """
    last = config.objective == "paper"
    state = start if last else solve_reflectivity(observations, start, config)
    if on_solved is not None:
        on_solved()
    state = refine(
        observations,
        state,
        config,
        seed,
        checkpoint=checkpoint,
        on_step=on_step,
        encoder=encoder,
        scalars=scalars,
    )
    return solve_reflectivity(observations, state, config) if last else state
