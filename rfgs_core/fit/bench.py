# SPDX-License-Identifier: Apache-2.0
"""How long a frame takes to train until its validation loss stands still."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from rfgs_core.dataset import open_dataset
from rfgs_core.device import Device, finish_device, most_held_gib, need_device
from rfgs_core.errors import RfgsError
from rfgs_core.fit.frame import FrameState, solved_frame
from rfgs_core.fit.losses import channel_loss
from rfgs_core.fit.refine import refine
from rfgs_core.frames import chosen_frames
from rfgs_core.measure.observations import Observations, observe
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import comparison_of
from rfgs_core.model.first_powers import noise_per_link
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig

#: The loss stands still when it changes by less than this …
STILL = 0.01
#: … over as many steps.
WINDOW = 50
#: Steps after which nobody waits any longer.
LIMIT = 1000


@dataclass(frozen=True)
class TrainingBench:
    """What is trained, and for how long."""

    gaussians: int = 20_000
    """Gaussians of the timed frame."""
    steps: int | None = None
    """Adam steps; None: until the loss stands still."""
    device: Device = "cpu"
    """Where reflectivities are solved and Gaussians refined."""


def bench_training(
    dataset: Path, radio: str, frame: int | None, bench: TrainingBench | None = None
) -> dict[str, Any]:
    """Trains one frame until the loss of links that training does not see stands still.

    A tenth of the visible links is set aside for that, by chance. What is timed is everything
    from the channel to the Gaussians: locating the body, the start, reflectivities and steps.

    Args:
        dataset: Folder of the dataset.
        radio: Name of the radio.
        frame: Frame number; None for the first.
        bench: Gaussians, steps and device.

    Returns:
        `train_s` of the training whose last window stands still, or of the steps asked for, its
        `start_s`, `steps`, `loss_start`, `loss_end`, `still`, the most memory that was held
        [GiB], and what was trained.

    Raises:
        RfgsError: There is no such radio, frame or device.
    """
    bench = bench or TrainingBench()
    need_device(bench.device)
    whole = _observed(dataset, radio, frame)
    seen, aside = _with_links_aside(whole)
    config = TrainConfig(num_gaussians=bench.gaussians, device=bench.device)
    seed = sub_seed(0, "bench training", "fit")
    begin = time.perf_counter()
    start, start_s = solved_frame(seen, config, seed), time.perf_counter() - begin
    losses, train_s, steps, still = [_validation(whole, aside, start, config)], start_s, 0, False
    lengths = range(WINDOW, LIMIT + 1, WINDOW) if bench.steps is None else [bench.steps]
    with tqdm(total=lengths[-1], desc="bench training", unit="step") as bar:

        def on_step(_loss: float, _count: int) -> None:
            bar.update(1)

        for steps in lengths:
            # From the start each time: what is timed is one training of so many steps.
            bar.reset()
            begin = time.perf_counter()
            state = refine(seen, start, replace(config, iterations=steps), seed, on_step=on_step)
            finish_device()
            train_s = start_s + time.perf_counter() - begin
            losses.append(_validation(whole, aside, state, config))
            bar.set_postfix_str(f"validation loss {losses[-1]:.4g}")
            still = abs(losses[-1] - losses[-2]) < STILL * losses[-2]
            if still:
                break
    return {
        "device": bench.device,
        "gaussians": bench.gaussians,
        "links": int(seen.links.sum()),
        "subcarriers": int(seen.subcarriers.sum()),
        "train_s": train_s,
        "start_s": start_s,
        "steps": steps,
        "loss_start": losses[0],
        "loss_end": losses[-1],
        "still": still,
        "memory_gib": most_held_gib(bench.device),
    }


def _observed(dataset: Path, radio: str, frame: int | None) -> Observations:
    """A frame, the first if none is named."""
    sequence = open_dataset(dataset).sequence()
    if radio not in sequence.radios:
        raise RfgsError(f"{dataset} has no radio {radio!r}; it has {', '.join(sequence.radios)}")
    chosen = chosen_frames(None if frame is None else str(frame), sequence.frames)[0]
    return observe(sequence, radio, chosen)


def _with_links_aside(whole: Observations) -> tuple[Observations, np.ndarray]:
    """Observations without a tenth of their links, and which those are, (tx, rx)."""
    rng = np.random.default_rng(sub_seed(0, "bench training"))
    aside = whole.links & (rng.random(whole.links.shape) < 0.1)
    delta = np.where(aside[..., None], 0, whole.delta).astype(np.complex64)
    return replace(whole, links=whole.links & ~aside, delta=delta), aside


def _validation(
    whole: Observations, aside: np.ndarray, state: FrameState, config: TrainConfig
) -> float:
    """Channel loss of the links that were set aside."""
    hidden = replace(whole, links=aside)
    channel = Channel.of(hidden, hidden.links, hidden.subcarriers)
    target = comparison_of(hidden).measured()
    noise = noise_per_link(hidden, target, config.unexplained)
    with torch.no_grad():
        return float(channel_loss(channel.change(state.head, state.gaussians), target, noise))
