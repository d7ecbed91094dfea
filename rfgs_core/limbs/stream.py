# SPDX-License-Identifier: Apache-2.0
"""Frames of random worlds to learn from, as they are made, and those that are kept."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import torch
from jaxtyping import Float32
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from rfgs_core.device import Device
from rfgs_core.encode.body_maps import Ranges
from rfgs_core.limbs.tokens import Packed, pack, packed_power
from rfgs_core.radio import Radio
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.batch import Batch, batch_of
from rfgs_core.worlds.batched_echoes import BatchedEchoes
from rfgs_core.worlds.heard import examples
from rfgs_core.worlds.moments import acted

#: Frames that a worker makes at a time; moments of one motion where a GPU hears them.
CHUNK, MOMENTS = 64, 48
#: Most device pairs of a world of five devices: a radar hears itself, others everyone.
_RADAR_PAIRS, _ALL_PAIRS = 5, 25
#: How often a worker looks whether its parent lives [s].
_WATCH_S = 2.0


class Chunk(NamedTuple):
    """Frames and their joints."""

    packed: Packed
    joints: Float32[Tensor, "frame 17 3"]
    """Around the maps' centre [m]."""


def pairs_of(radio: Radio) -> int:
    """Device pairs that are kept of a world."""
    return _RADAR_PAIRS if radio.own_device_links == "only" else _ALL_PAIRS


def next_chunk(stream: Iterator, count: int, pairs: int) -> Chunk:
    """The next frames of a stream of `examples`."""
    rows = [next(stream) for _ in range(count)]
    packed = pack([(row.views, row.maps, row.centre) for row in rows], pairs)
    joints = np.array([row.joints - row.centre for row in rows], dtype=np.float32)
    return Chunk(packed, torch.from_numpy(joints))


class _Worlds(IterableDataset):
    """Chunks of random worlds without end, or what a GPU makes them from."""

    def __init__(self, radio: Radio, seed: int, device: Device, moments: int) -> None:
        self.radio, self.seed, self.device, self.moments = radio, seed, device, moments

    def __iter__(self) -> Iterator[Chunk | tuple[np.ndarray, ...]]:
        torch.set_num_threads(1)
        info = get_worker_info()
        seed = sub_seed(self.seed, 0 if info is None else info.id)
        if self.device == "cpu":
            stream = examples(self.radio, seed)
            while True:
                yield next_chunk(stream, CHUNK, pairs_of(self.radio))
        for done in acted(self.radio, seed, self.moments):
            if done.moments:
                # By value through the pipe: tensors would each be shared memory to be opened.
                drawn = batch_of(self.radio, done, pairs_of(self.radio))
                yield tuple(value.numpy() for value in drawn)


def chunks(
    radio: Radio, seed: int, device: Device, workers: int, moments: int = MOMENTS
) -> Iterator[Chunk]:
    """Chunks of frames of random worlds without end, each worker's from worlds of its own.

    Args:
        radio: The radio.
        seed: Seed of the worlds.
        device: Where frames are heard and kept.
        workers: Processes that draw worlds, and on a CPU hear them too; 0 is this one.
        moments: Moments of one motion, where a GPU hears them.
    """
    loader = DataLoader(
        _Worlds(radio, seed, device, moments), batch_size=None, num_workers=workers,
        multiprocessing_context="spawn" if workers else None,
        prefetch_factor=8 if workers else None, worker_init_fn=_end_with_parent,
        collate_fn=_as_it_is,
    )  # fmt: skip
    if device == "cpu":
        yield from loader
        return
    echoes = BatchedEchoes(radio, device)
    for drawn in loader:
        batch = Batch(*(torch.from_numpy(value).to(device) for value in drawn))
        yield heard_chunk(echoes, batch)


def _as_it_is(drawn: Any) -> Any:
    """What a worker made, which is a batch already."""
    return drawn


def heard_chunk(echoes: BatchedEchoes, batch: Batch) -> Chunk:
    """What device pairs hear of a batch, packed."""
    rows = torch.arange(len(batch.joints), device=batch.joints.device)[:, None]
    ends = [batch.ends[rows, batch.pairs[..., side], side] for side in (0, 1)]
    vectors = torch.stack([ends[0][:, :, 0], ends[1][:, :, 0]], 2)
    vectors = torch.cat([vectors, ends[0][:, :, 1:], ends[1][:, :, 1:]], 2)
    counts = torch.cat([batch.counts[rows, batch.pairs[..., side], side] for side in (0, 1)], -1)
    packed = packed_power(echoes.maps(batch), vectors, counts, batch.there)
    return Chunk(packed, batch.joints)


def _end_with_parent(worker: int) -> None:
    """Lets a worker end when its parent was killed, which it does not notice in a queue."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class Kept:
    """The last frames, to be seen again."""

    def __init__(self, size: int, radio: Radio, device: Device) -> None:
        pairs, ranges = pairs_of(radio), Ranges.of(radio.bandwidth_hz).count
        self.packed = Packed(
            torch.zeros((size, pairs, 7, 5, ranges), dtype=torch.uint8, device=device),
            torch.zeros((size, pairs), device=device),
            torch.zeros((size, pairs, 6, 3), device=device),
            torch.zeros((size, pairs, 4), device=device),
            torch.zeros((size, pairs), dtype=torch.bool, device=device),
        )
        self.joints = torch.zeros((size, 17, 3), device=device)
        self.size, self.seen = size, 0

    def add(self, chunk: Chunk) -> None:
        """Puts a chunk in the place of the oldest."""
        rows = torch.arange(self.seen, self.seen + len(chunk.joints)) % self.size
        rows = rows.to(self.joints.device)
        for own, new in zip(self.packed, chunk.packed, strict=True):
            own[rows] = new
        self.joints[rows] = chunk.joints
        self.seen += len(rows)

    def draw(self, count: int, generator: torch.Generator) -> Chunk:
        """Frames by chance."""
        most, device = min(self.seen, self.size), self.joints.device
        rows = torch.randint(most, (count,), generator=generator, device=device)
        return Chunk(Packed(*(own[rows] for own in self.packed)), self.joints[rows])
