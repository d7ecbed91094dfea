# SPDX-License-Identifier: Apache-2.0
"""Trains a pose network on examples in memory, and goes on where it was stopped."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from rfgs_core.adam import Adam
from rfgs_core.limbs.progress import Progress, keep, resume
from rfgs_core.limbs.tokens import mirrored_joints, rotate
from rfgs_core.pose_networks.lessons import Lessons
from rfgs_core.seeds import sub_seed

#: Share of a recording, the last in time, that a network is judged by and never learns from.
JUDGED = 0.2
#: Steps from one state that is kept to the next.
_KEPT = 100

#: What training does to a batch, with chance from a generator.
Change = Callable[[Lessons, torch.Generator], Lessons]


@dataclass(frozen=True)
class Training:
    """How a network is trained."""

    passes: float
    """How often it sees each example."""
    batch: int
    """Examples of a step."""
    rate: float = 1e-3
    """Largest step of the optimiser (AdamW)."""
    seed: int = 0
    """Seed of weights and of the order of examples."""

    def steps(self, examples: int) -> int:
        """How many steps that is for so many examples."""
        return max(math.ceil(self.passes * examples / self.batch), 1)


def split(all_of: Lessons, recorded: int) -> tuple[Lessons, Lessons]:
    """What is learnt from, and the last fifth of every recording in time.

    Args:
        all_of: Examples, one recording after the other.
        recorded: Examples of a recording.
    """
    within = torch.arange(len(all_of.joints)) % recorded
    known = within < (1.0 - JUDGED) * recorded - 1e-6
    return all_of.rows(known), all_of.rows(~known)


def train(
    network: nn.Module,
    known: Lessons,
    training: Training,
    change: Change,
    checkpoint: Path | None = None,
    on_step: Callable[[int, str], None] = lambda done, words: None,
) -> Progress:
    """Minimises the mean distance of joints.

    Args:
        network: Reads the inputs of examples, says joints [m].
        known: What to learn from.
        training: How.
        change: What is done to each batch.
        checkpoint: File to go on from, and to keep the state in; None keeps nothing.
        on_step: Called after each step with the steps so far and a few words.

    Returns:
        Steps, and how long they took.
    """
    optimiser = Adam.of(network.parameters(), training.rate, decay=0.02)
    progress, asked = Progress(0, 0.0), f"{training} of {len(known.joints)} examples"
    if checkpoint is not None and checkpoint.exists():
        progress = resume(checkpoint, network, optimiser, asked)
    steps = training.steps(len(known.joints))
    begun, told = time.monotonic() - progress.spent_s, math.nan
    for step in range(progress.frames, steps):
        # The same batch whenever this step is made, also after a stop.
        generator = torch.Generator().manual_seed(sub_seed(training.seed, "step", step))
        rows = torch.randint(len(known.joints), (training.batch,), generator=generator)
        batch = change(known.rows(rows), generator)
        network.train()
        optimiser.set_rate(_rate(training.rate, step / steps))
        error = (network(*batch.inputs) - batch.joints).square().sum(-1).add(1e-8).sqrt().mean()
        optimiser.zero_grad()
        error.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        now = float(error.detach())
        told = now if math.isnan(told) else 0.98 * told + 0.02 * now
        progress = Progress(step + 1, time.monotonic() - begun)
        if checkpoint is not None and (progress.frames % _KEPT == 0 or progress.frames == steps):
            keep(checkpoint, network, optimiser, progress, asked)
        on_step(progress.frames, f"off by {told:.3f} m")
    network.eval()
    return progress


def _rate(most: float, share: float) -> float:
    """Step size: a short rise, then half a cosine down."""
    return most * (min(share / 0.03, 1.0) * 0.5 * (1.0 + math.cos(math.pi * share)) + 1e-3)


def turned(batch: Lessons, generator: torch.Generator) -> Lessons:
    """Clips of points seen from anywhere around, half of them in a mirror."""
    points, there = batch.inputs
    clips, frames = points.shape[:2]
    angle = (torch.rand(clips, generator=generator) * (2.0 * math.pi)).repeat_interleave(frames)
    mirror = (torch.rand(clips, generator=generator) < 0.5).repeat_interleave(frames)
    flat = points.flatten(0, 1)
    places = rotate(flat[..., :3], angle)
    flipped = places * places.new_tensor([1.0, -1.0, 1.0])
    places = torch.where(mirror[:, None, None], flipped, places)
    joints = mirrored_joints(rotate(batch.joints.flatten(0, 1), angle), mirror)
    points = torch.cat([places, flat[..., 3:]], -1).unflatten(0, (clips, frames))
    return Lessons((points, there), joints.unflatten(0, (clips, frames)))


def as_heard(batch: Lessons, generator: torch.Generator) -> Lessons:
    """A batch as it is: where devices stand is learnt by heart."""
    return batch


def asked(network: nn.Module, inputs: tuple[Tensor, ...], at_once: int = 64) -> Tensor:
    """What a network says of examples, some at once."""
    network.eval()
    with torch.no_grad():
        parts = zip(*(value.split(at_once) for value in inputs), strict=True)
        return torch.cat([network(*part) for part in parts])


def errors(
    said: Float[Tensor, "*frame 17 3"], truth: Float[Tensor, "*frame 17 3"]
) -> dict[str, float]:
    """Mean joint error as it is, and with the pelvis put in place [m]."""
    apart = (said - truth).double().numpy()
    aligned = apart - apart[..., :1, :]
    return {
        "joints_m": float(np.linalg.norm(apart, axis=-1).mean()),
        "aligned_m": float(np.linalg.norm(aligned, axis=-1).mean()),
    }
