# SPDX-License-Identifier: Apache-2.0
"""Trains the network on random worlds as they are made: no camera, no scene of ours, no disk."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import torch

from rfgs_core.adam import Adam
from rfgs_core.device import Device
from rfgs_core.encode.body_maps import Ranges
from rfgs_core.limbs.disturb import disturbed
from rfgs_core.limbs.network import LimbNetwork, Size
from rfgs_core.limbs.progress import Progress, keep, resume
from rfgs_core.limbs.stream import Chunk, Kept, chunks
from rfgs_core.limbs.tokens import Packed, mirrored_joints, relative_power, rotate, tokens
from rfgs_core.radio import Radio
from rfgs_core.seeds import sub_seed

#: Frames to judge by, from worlds of their own, and moments of each of their motions.
JUDGED, _FEW_MOMENTS = 512, 4
#: Frames before the first step, and between looks at unseen worlds.
_FIRST, _OFTEN = 2048, 4096
#: Weight of the likelihood of σ beside the error itself.
_SIGMA_WEIGHT = 0.05
#: Steps whose error is told.
_TOLD = 256


@dataclass(frozen=True)
class LearnConfig:
    """How a network is trained."""

    frames: int = 300_000
    """Frames of random worlds that it sees; more is better, and takes longer."""
    hours: float | None = None
    """Ends after this long, however many frames there were."""
    passes: float = 24.0
    """How often each frame is seen, on average; frames are kept and seen again."""
    kept: int = 150_000
    """Frames that are kept in memory."""
    workers: int = 1
    """Processes that make worlds."""
    batch: int = 64
    """Frames of a step."""
    size: Size = "small"
    """Size of the network."""
    rate: float = 1e-3
    """Largest step of the optimiser (AdamW)."""
    device: Device = "cpu"
    """Where it is trained, and where worlds are heard."""
    seed: int = 0
    """Seed of worlds and weights."""

    @property
    def least_frames(self) -> int:
        """How many it takes for a first step; with fewer the network stays as it was drawn."""
        first = min(_FIRST, self.kept)
        return max(first, self.batch, math.ceil(self.batch / self.passes))

    def share(self, progress: Progress) -> float:
        """How much of the training is done."""
        spent = 0.0 if self.hours is None else progress.spent_s / (3600.0 * self.hours)
        return max(progress.frames / self.frames, spent)


class Learned(NamedTuple):
    """A trained network."""

    network: LimbNetwork
    unseen_m: float
    """Mean joint error in worlds it was not trained on, asked once, everything heard [m]."""
    progress: Progress


def learn(
    radio: Radio,
    config: LearnConfig,
    on_chunk: Callable[[int, str], None] = lambda done, words: None,
    checkpoint: Path | None = None,
) -> Learned:
    """Trains a network for one kind of radio.

    Args:
        radio: The radio.
        config: How.
        on_chunk: Called after each chunk with the frames so far and a few words.
        checkpoint: File to go on from, and to keep the state in now and then; None keeps nothing.

    Returns:
        The network, ready to be asked, and how it did.
    """
    torch.manual_seed(config.seed)
    generator = torch.Generator(config.device)
    generator.manual_seed(sub_seed(config.seed, radio.name, "draws"))
    network = LimbNetwork(Ranges.of(radio.bandwidth_hz).count, config.size).to(config.device)
    optimiser = Adam.of(network.parameters(), config.rate, decay=0.02)
    kept = Kept(config.kept, radio, config.device)
    # How long it goes on, where and by how many workers may change.
    fixed = replace(config, frames=0, hours=None, workers=0, device="cpu")
    progress, asked = Progress(0, 0.0), f"{radio} {fixed}"
    if checkpoint is not None and checkpoint.exists():
        progress = resume(checkpoint, network, optimiser, asked)
    judged = _judged(radio, config)
    # Whoever goes on sees other worlds than before.
    worlds = sub_seed(config.seed, "from", progress.frames)
    begun, owed, words, unseen = time.monotonic() - progress.spent_s, 0.0, "", math.nan
    errors: list[torch.Tensor] = []
    recorded = config.device == "cpu"
    looked = progress.frames
    for chunk in chunks(radio, worlds, config.device, config.workers):
        kept.add(chunk)
        count = len(chunk.joints)
        progress = Progress(progress.frames + count, time.monotonic() - begun)
        share = config.share(progress)
        optimiser.set_rate(_rate(config.rate, share))
        owed += config.passes * count / config.batch
        while owed >= 1.0 and kept.seen >= min(_FIRST, config.kept):
            batch = kept.draw(config.batch, generator)
            if not recorded:
                _record(network, batch, generator)
                recorded = True
            errors = [*errors[1 - _TOLD :], _step(network, optimiser, batch, generator)]
            owed -= 1.0
        if progress.frames - looked >= _OFTEN * max(config.batch // 64, 1) or share >= 1.0:
            looked = progress.frames
            unseen = judge(network, judged)
            # Whoever ends by the clock may do so before the first step.
            told = f"off by {float(torch.stack(errors).mean()):.3f} m, " if errors else ""
            words = f"{told}in unseen worlds {unseen:.4f} m"
            if checkpoint is not None and errors:
                keep(checkpoint, network, optimiser, progress, asked)
        on_chunk(progress.frames, words)
        if share >= 1.0:
            break
    network.eval()
    return Learned(network.cpu(), unseen, progress)


def _record(network: LimbNetwork, chunk: Chunk, generator: torch.Generator) -> None:
    """Lets a GPU replay the network's kernels in steps, since to start them takes longer than they.

    Products of matrices are in TF32 from here on.
    """
    torch.set_float32_matmul_precision("high")
    # Declared for tensors, made for trees of them.
    like: Any = disturbed(chunk.packed, generator)[0]
    torch.cuda.make_graphed_callables(network.train(), (like,))


def _judged(radio: Radio, config: LearnConfig) -> Chunk:
    """Frames to judge by."""
    parts: list[Chunk] = []
    seed = sub_seed(config.seed, "judged")
    for part in chunks(radio, seed, config.device, workers=0, moments=_FEW_MOMENTS):
        parts.append(part)
        if sum(len(each.joints) for each in parts) >= JUDGED:
            break
    packed = Packed(*(torch.cat(rows) for rows in zip(*(p.packed for p in parts), strict=True)))
    return Chunk(packed, torch.cat([part.joints for part in parts]))


def _rate(most: float, share: float) -> float:
    """Step size: a short rise, then half a cosine down."""
    rise = min(share / 0.01, 1.0)
    return most * (rise * 0.5 * (1.0 + math.cos(math.pi * min(share, 1.0))) + 1e-3)


def _step(
    network: LimbNetwork,
    optimiser: Adam,
    chunk: Chunk,
    generator: torch.Generator,
) -> torch.Tensor:
    """One step on some frames; returns their mean joint error [m]."""
    network.train()
    seen, mirror = disturbed(chunk.packed, generator)
    joints = rotate(chunk.joints, -seen.yaw)
    found, log_sigma = network(seen)
    error = (found - mirrored_joints(joints, mirror)).pow(2).sum(-1).add(1e-6).sqrt()
    sure = error.detach() / log_sigma.exp() + log_sigma
    loss = error.mean() + _SIGMA_WEIGHT * sure.mean()
    optimiser.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimiser.step()
    return error.detach().mean()


def judge(network: LimbNetwork, chunk: Chunk) -> float:
    """Mean joint error of the plain network, seen from each frame's first pair [m]."""
    network.eval()
    packed = chunk.packed
    mirror = torch.zeros(len(chunk.joints), dtype=torch.bool, device=chunk.joints.device)
    with torch.no_grad():
        reference = packed.there.float().argmax(1)
        seen = tokens(packed, relative_power(packed), packed.there, reference, mirror)
        errors = (network(seen)[0] - rotate(chunk.joints, -seen.yaw)).norm(dim=-1)
    return float(errors.mean())
