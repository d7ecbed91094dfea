# SPDX-License-Identifier: Apache-2.0
"""How often the number of people is right, beside channels in which nobody is to be counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rfgs_core.bodies.count import count_bodies, one_more_counts
from rfgs_core.bodies.gain import NOBODY, gain_near
from rfgs_core.dataset import Sequence
from rfgs_core.measure.observations import Observations, observe
from rfgs_core.run.people import told, voted
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig

#: Frames whose place is also taken by channels without anybody.
EMPTY_FRAMES = 3
#: By how much gains of devices have drifted in the empty room that is heard anew.
DRIFT = 0.01


def head_count_table(
    sequence: Sequence,
    radio: str,
    frames: list[int],
    *,
    everything: bool = False,
    on_frame: Callable[[], Any] = lambda: None,
) -> dict[str, float]:
    """Counts of every frame held against the dataset's instances.

    Args:
        sequence: The data.
        radio: Which radio.
        frames: Which frames.
        everything: Whether what is held out is seen as well.
        on_frame: Called when a frame is done.

    Returns:
        `people` in the scene, and what the frames' `vote` is; how many frames are `right`, count
        somebody `over` or somebody `under`. Mean count of noise alone and of the empty room heard
        anew. Of the people counted, the share whom the
        radio of the frame half a sequence away confirms at their places; not of a single frame.
    """
    true = told(sequence)
    seen = [observe(sequence, radio, frame, everything=everything) for frame in frames]
    counts: list[int] = []
    nobody: dict[str, list[int]] = {"noise": [], "empty": []}
    confirmed = 0
    config = TrainConfig()
    for index, (frame, now) in enumerate(zip(frames, seen, strict=True)):
        seed = sub_seed(0, sequence.name, radio, frame, "people")
        found = count_bodies(now, config, seed)
        other = seen[(index + len(seen) // 2) % len(seen)]
        there = [one_more_counts([gain_near(other, NOBODY, one.body)]) for one in found]
        confirmed += sum(there)
        counts.append(len(found))
        if index < EMPTY_FRAMES:
            for name, nobody_there in (("noise", noise_alone), ("empty", empty_room_anew)):
                nobody[name].append(len(count_bodies(nobody_there(now, seed), config, seed)))
        on_frame()
    confirms = {"confirmed by another frame": confirmed / max(sum(counts), 1)}
    return {
        "people": true,
        "vote": voted(counts),
        "right": sum(count == true for count in counts),
        "over": sum(count > true for count in counts),
        "under": sum(count < true for count in counts),
        "frames": len(counts),
        "noise alone": float(np.mean(nobody["noise"])),
        "empty room heard anew": float(np.mean(nobody["empty"])),
        **(confirms if len(frames) > 1 else {}),
    }


def noise_alone(observations: Observations, seed: int) -> Observations:
    """White noise as strong as a frame's change."""
    rng = np.random.default_rng(sub_seed(seed, "noise"))
    entries = observations.links[..., None] & observations.subcarriers
    level = np.sqrt(np.mean(np.abs(observations.delta[entries]) ** 2))
    return observations.with_delta(np.where(entries, level * _normal(rng, entries.shape), 0.0))


def empty_room_anew(observations: Observations, seed: int) -> Observations:
    """The empty room while every device's gain drifts by `DRIFT` and noise is as strong again."""
    rng = np.random.default_rng(sub_seed(seed, "drift"))
    layout, static = observations.layout, observations.static
    drift = [
        DRIFT * _normal(rng, ends.max() + 1)[ends] for ends in (layout.tx_device, layout.rx_device)
    ]
    change = static * (drift[0][:, None, None] + drift[1][None, :, None])
    noisy = change + np.abs(change) * _normal(rng, change.shape)
    return replace(observations, delta=noisy.astype(np.complex64), packets=None)


def _normal(rng: np.random.Generator, shape: Any) -> np.ndarray:
    """Complex normal values of variance 1."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
