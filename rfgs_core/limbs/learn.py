# SPDX-License-Identifier: Apache-2.0
"""Trains the network on random worlds as they are made: no camera, no scene of ours, no disk."""

from __future__ import annotations

import functools
import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from rfgs_core.encode.body_maps import Ranges
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.progress import Progress, keep, resume
from rfgs_core.limbs.tokens import (
    Packed,
    Tokens,
    mirrored_joints,
    pack,
    relative_power,
    rotate,
    tokens,
)
from rfgs_core.radio import Radio
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.heard import examples

#: Frames that a worker makes at a time, and of one step.
CHUNK, BATCH = 64, 64
#: Most device pairs of a world of five devices: a radar hears itself, others everyone.
_RADAR_PAIRS, _ALL_PAIRS = 5, 25
#: Frames to judge by, from worlds of their own.
JUDGED = 512
#: Frames before the first step, and chunks between looks at unseen worlds.
_FIRST, _OFTEN = 2048, 64
#: How often a worker looks whether its parent lives [s].
_WATCH_S = 2.0
#: Weight of the likelihood of σ beside the error itself.
_SIGMA_WEIGHT = 0.05
#: Share of batches' frames that miss one device (pair), and a second one.
_ONE_SILENT, _TWO_SILENT = 0.5, 0.1
#: Noise below the peak of a pair, log10: quietest, and how much louder it may be.
_QUIET, _LOUDER = -3.2, 2.0
#: Samples of noise that are kept.
_POOL = 2**22
#: Deviation of a pair's gain, natural log of power.
_GAIN = 0.35


@dataclass(frozen=True)
class LearnConfig:
    """How a network is trained."""

    frames: int = 300_000
    """Frames of random worlds that it sees; more is better, and takes longer."""
    steps_per_chunk: float = 24.0
    """Steps of 64 frames for every 64 new ones; frames are kept and seen again."""
    kept: int = 150_000
    """Frames that are kept in memory."""
    workers: int = 1
    """Processes that make worlds."""
    rate: float = 1e-3
    """Largest step of the optimiser (AdamW)."""
    seed: int = 0
    """Seed of worlds and weights."""


class Learned(NamedTuple):
    """A trained network."""

    network: LimbNetwork
    unseen_m: float
    """Mean joint error in worlds it was not trained on, asked once, everything heard [m]."""
    progress: Progress


@dataclass(frozen=True)
class Chunk:
    """Frames and their joints."""

    packed: Packed
    joints: Float32[np.ndarray, "frame 17 3"]
    """Around the maps' centre [m]."""


def pairs_of(radio: Radio) -> int:
    """Device pairs that are kept of a world."""
    return _RADAR_PAIRS if radio.own_device_links == "only" else _ALL_PAIRS


class Worlds(IterableDataset):
    """Chunks of random worlds without end; each worker has worlds of its own."""

    def __init__(self, radio: Radio, seed: int) -> None:
        self.radio, self.seed = radio, seed

    def __iter__(self) -> Iterator[Chunk]:
        torch.set_num_threads(1)
        info = get_worker_info()
        stream = examples(self.radio, sub_seed(self.seed, 0 if info is None else info.id))
        while True:
            yield next_chunk(stream, CHUNK, pairs_of(self.radio))


def next_chunk(stream: Iterator, count: int, pairs: int) -> Chunk:
    """The next frames of a stream of examples."""
    rows = [next(stream) for _ in range(count)]
    packed = pack([(row.views, row.maps, row.centre) for row in rows], pairs)
    joints = np.array([row.joints - row.centre for row in rows], dtype=np.float32)
    return Chunk(packed, joints)


class Kept:
    """The last frames, to be seen again."""

    def __init__(self, size: int, radio: Radio) -> None:
        pairs, ranges = pairs_of(radio), Ranges.of(radio.bandwidth_hz).count
        self.packed = Packed(
            np.zeros((size, pairs, 7, 5, ranges), dtype=np.uint8),
            np.zeros((size, pairs), dtype=np.float32),
            np.zeros((size, pairs, 6, 3), dtype=np.float32),
            np.zeros((size, pairs, 4), dtype=np.float32),
            np.zeros((size, pairs), dtype=bool),
        )
        self.joints = np.zeros((size, 17, 3), dtype=np.float32)
        self.size, self.seen = size, 0

    def add(self, chunk: Chunk) -> None:
        """Puts a chunk in the place of the oldest."""
        rows = (self.seen + np.arange(len(chunk.joints))) % self.size
        for own, new in zip(self.packed, chunk.packed, strict=True):
            own[rows] = new
        self.joints[rows] = chunk.joints
        self.seen += len(rows)

    def draw(self, count: int, rng: np.random.Generator) -> Chunk:
        """Frames by chance."""
        rows = rng.integers(min(self.seen, self.size), size=count)
        return Chunk(Packed(*(own[rows] for own in self.packed)), self.joints[rows])


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
    rng = np.random.default_rng(sub_seed(config.seed, radio.name, "draws"))
    network = LimbNetwork(Ranges.of(radio.bandwidth_hz).count)
    optimiser = torch.optim.AdamW(network.parameters(), config.rate, weight_decay=0.02)
    kept = Kept(config.kept, radio)
    progress = Progress(0, 0.0)
    if checkpoint is not None and checkpoint.exists():
        progress = resume(checkpoint, network, optimiser)
    judged = next_chunk(examples(radio, sub_seed(config.seed, "judged")), JUDGED, pairs_of(radio))
    # Whoever goes on sees other worlds than before.
    loader = DataLoader(
        Worlds(radio, sub_seed(config.seed, "from", progress.frames)), batch_size=None,
        num_workers=config.workers,
        multiprocessing_context="spawn" if config.workers else None,
        prefetch_factor=8 if config.workers else None, worker_init_fn=_end_with_parent,
    )  # fmt: skip
    begun, owed, words, unseen = time.monotonic() - progress.spent_s, 0.0, "", math.nan
    errors: list[float] = []
    for chunk in loader:
        kept.add(chunk)
        progress = Progress(progress.frames + CHUNK, time.monotonic() - begun)
        share = progress.frames / config.frames
        for group in optimiser.param_groups:
            group["lr"] = _rate(config.rate, share)
        owed += config.steps_per_chunk
        while owed >= 1.0 and kept.seen >= min(_FIRST, config.kept):
            errors.append(_step(network, optimiser, kept.draw(BATCH, rng), rng))
            owed -= 1.0
        if progress.frames % (CHUNK * _OFTEN) == 0 or share >= 1.0:
            unseen = judge(network, judged)
            words = f"off by {np.mean(errors[-256:]):.3f} m, in unseen worlds {unseen:.4f} m"
            if checkpoint is not None:
                keep(checkpoint, network, optimiser, progress)
        on_chunk(progress.frames, words)
        if share >= 1.0:
            break
    network.eval()
    return Learned(network, unseen, progress)


def _end_with_parent(worker: int) -> None:
    """Lets a worker end when its parent was killed, which it does not notice in a queue."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _rate(most: float, share: float) -> float:
    """Step size: a short rise, then half a cosine down."""
    rise = min(share / 0.01, 1.0)
    return most * (rise * 0.5 * (1.0 + math.cos(math.pi * min(share, 1.0))) + 1e-3)


def _step(
    network: LimbNetwork, optimiser: torch.optim.Optimizer, chunk: Chunk, rng: np.random.Generator
) -> float:
    """One step on some frames; returns their mean joint error [m]."""
    network.train()
    seen, mirror = _drawn(chunk.packed, rng)
    joints = rotate(torch.from_numpy(chunk.joints), -seen.yaw)
    found, log_sigma = network(seen)
    error = (found - mirrored_joints(joints, mirror)).pow(2).sum(-1).add(1e-6).sqrt()
    sure = error.detach() / log_sigma.exp() + log_sigma
    loss = error.mean() + _SIGMA_WEIGHT * sure.mean()
    optimiser.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimiser.step()
    return float(error.detach().mean())


def _drawn(packed: Packed, rng: np.random.Generator) -> tuple[Tokens, Bool[Tensor, "frame"]]:
    """Frames with other gains and noise, some of their devices silent, half of them mirrored."""
    count, pairs = packed.there.shape
    generator = torch.Generator().manual_seed(int(rng.integers(2**31)))
    power = relative_power(packed)
    noise = torch.rand(count, pairs, 1, 1, 1, generator=generator) * _LOUDER + _QUIET
    power = power + _speckle(power.shape, rng) * 10.0**noise
    packed = packed._replace(
        level=packed.level + rng.normal(0.0, _GAIN / np.log(10), packed.level.shape).astype("f4")
    )
    there = _heard(packed, rng)
    order = torch.where(there, torch.rand(count, pairs, generator=generator), -1.0)
    mirror = torch.rand(count, generator=generator) < 0.5
    return tokens(packed, power, there, order.argmax(1), mirror), mirror


@functools.cache
def _speckle_pool() -> Float[Tensor, "sample"]:
    """Power of complex normal noise; drawing it anew would take longer than the network."""
    return torch.empty(_POOL).exponential_(generator=torch.Generator().manual_seed(0))


def _speckle(shape: torch.Size, rng: np.random.Generator) -> Tensor:
    """Noise power of mean 1: a stretch of the pool, from anywhere."""
    first = int(rng.integers(_POOL))
    count = math.prod(shape)
    pool = _speckle_pool()
    stretch = torch.cat([pool[first:], pool.repeat(-(-count // _POOL))])[:count]
    return stretch.reshape(shape)


def _heard(packed: Packed, rng: np.random.Generator) -> Bool[Tensor, "frame pair"]:
    """Pairs of which a few are left out, in both directions."""
    there = packed.there.copy()
    for share in (_ONE_SILENT, _TWO_SILENT):
        chosen = _one_of(there, rng)
        ends = packed.vectors[np.arange(len(there)), chosen][:, :2]
        both = packed.vectors[:, :, :2]
        same = _near(both[:, :, 1], ends[:, 1]) & _near(both[:, :, 0], ends[:, 0])
        # The way back: transmitter and receiver of a device are a few decimetres apart.
        back = _near(both[:, :, 1], ends[:, 0], 0.5) & _near(both[:, :, 0], ends[:, 1], 0.5)
        silent = (same | back) & (rng.random(len(there)) < share)[:, None]
        left = there & ~silent
        there = np.where(left.any(axis=1, keepdims=True), left, there)
    return torch.from_numpy(there)


def _near(
    places: Float[np.ndarray, "frame pair 3"], other: Float[np.ndarray, "frame 3"], m: float = 1e-3
) -> Bool[np.ndarray, "frame pair"]:
    return np.linalg.norm(places - other[:, None], axis=2) < m


def _one_of(there: Bool[np.ndarray, "frame pair"], rng: np.random.Generator) -> np.ndarray:
    """A pair of each frame by chance."""
    return np.where(there, rng.random(there.shape), -1.0).argmax(axis=1)


def judge(network: LimbNetwork, chunk: Chunk) -> float:
    """Mean joint error of the plain network, seen from each frame's first pair [m]."""
    network.eval()
    errors = []
    with torch.no_grad():
        for first in range(0, len(chunk.joints), BATCH):
            rows = slice(first, first + BATCH)
            packed = Packed(*(values[rows] for values in chunk.packed))
            there = torch.from_numpy(packed.there)
            reference = there.float().argmax(1)
            mirror = torch.zeros(len(there), dtype=torch.bool)
            seen = tokens(packed, relative_power(packed), there, reference, mirror)
            joints = rotate(torch.from_numpy(chunk.joints[rows]), -seen.yaw)
            errors.append((network(seen)[0] - joints).norm(dim=-1).mean(1))
    return float(torch.cat(errors).mean())
