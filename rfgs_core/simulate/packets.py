# SPDX-License-Identifier: Apache-2.0
"""Channels at several times within a frame, from few traces of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np

#: Longest time between traces of a frame with several samples [s].
TRACE_STEP_S = 0.02

Instant = TypeVar("Instant")


class Traces(Protocol[Instant]):
    """What can trace everything that moves, and mix traces at poses between them."""

    def trace_at(self, vertices: np.ndarray) -> Instant:
        """Traces everything with what moves at vertices [m], shape (V, 3)."""
        ...

    def mixture(
        self, vertices: np.ndarray, traces: Sequence[Instant], shares: Sequence[float]
    ) -> np.ndarray:
        """Channel at a pose, visibility and walls as traces have them, each with its share."""
        ...


def sampled(
    tracer: Traces[Instant],
    first: Instant,
    offset_s: np.ndarray,
    pose_at: Callable[[float], np.ndarray],
) -> list[np.ndarray]:
    """Channels after the first sample of a frame, each of shape (tx, rx, subcarrier).

    The scene is traced every `TRACE_STEP_S` at most; in between, what moves is where the
    animation has it, with exact path lengths, while visibility, walls and shadows fade from one
    trace to the next.

    Args:
        tracer: Traces and mixes.
        first: Trace at the first sample.
        offset_s: Times of all samples after the first [s], ascending from 0.
        pose_at: Vertices [m], shape (V, 3), at a time after the first sample [s].
    """
    parts = max(1, math.ceil(offset_s[-1] / TRACE_STEP_S - 1e-9))
    before, after, part = first, first, 0
    channels = []
    for time_s in offset_s[1:]:
        progress = time_s / offset_s[-1] * parts
        while part < progress and part < parts:
            part += 1
            before = after
            after = tracer.trace_at(pose_at(offset_s[-1] * part / parts))
        share = 1.0 - part + progress
        channels.append(tracer.mixture(pose_at(time_s), (before, after), (1.0 - share, share)))
    return channels
