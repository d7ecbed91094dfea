# SPDX-License-Identifier: Apache-2.0
"""A motion: poses over time, smooth between its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from rfgs_core.articulated import Pose
from rfgs_core.articulated.bones import PARENT_ROWS
from rfgs_core.articulated.turns import OPTIONS, chained, multiplied

#: Samples of motions [1/s].
RATE_HZ = 50.0


class Plate(NamedTuple):
    """A level board that bears feet or a body, from corner to corner [m], in a motion's world."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]


@dataclass(frozen=True)
class Motion:
    """What a person does, in a world of its own: from near the origin, first towards +x."""

    family: str
    """Which of `FAMILIES`."""
    neutral: np.ndarray
    """Rotation of each bone from rest to the anatomical position, shape [B, 3, 3]."""
    local: np.ndarray
    """Rotations against the parents from there, one row per sample, shape [T, B, 3, 3]."""
    root: np.ndarray
    """Head of the pelvis's bone at each sample [m], shape [T, 3]."""
    floor_m: np.ndarray
    """Height of what carries the person at each sample: floor, step or bed [m], shape [T]."""
    plates: tuple[Plate, ...] = ()
    """Treads and landings of stairs that belong to the motion."""

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return (len(self.root) - 1) / RATE_HZ

    def at(self, time_s: float) -> Pose:
        """The pose at a time [s]; before the start and after the end it is held."""
        root, turns = _between(
            self.root, self.local, self.neutral, PARENT_ROWS, float(time_s) * RATE_HZ
        )
        return Pose(root, turns)


@njit(**OPTIONS)
def _between(
    root: np.ndarray, local: np.ndarray, neutral: np.ndarray, parents: np.ndarray, at: float
) -> tuple[np.ndarray, np.ndarray]:
    """Root [3] and world rotations from rest [B, 3, 3] between samples.

    A cubic through four samples (Catmull and Rom 1974); axes are made orthonormal again.
    """
    last = len(root) - 1
    at = min(max(at, 0.0), float(last))
    low = min(math.floor(at), max(last - 1, 0))
    f = at - low
    weight = np.array(
        [
            0.5 * (-f + 2.0 * f * f - f * f * f),
            0.5 * (2.0 - 5.0 * f * f + 3.0 * f * f * f),
            0.5 * (f + 4.0 * f * f - 3.0 * f * f * f),
            0.5 * (-f * f + f * f * f),
        ]
    )
    place = np.zeros(3)
    turns = np.zeros(local.shape[1:])
    for k in range(4):
        row = min(max(low - 1 + k, 0), last)
        place += weight[k] * root[row]
        turns += weight[k] * local[row]
    for b in range(len(parents)):
        _square_up(turns[b])
    world = chained(parents, turns)
    for b in range(len(parents)):
        world[b] = multiplied(world[b], neutral[b])
    return place, world


@njit(**OPTIONS)
def _square_up(turn: np.ndarray) -> None:
    """Makes the columns of a matrix that is nearly a rotation orthonormal."""
    x, y = turn[:, 0].copy(), turn[:, 1].copy()
    x /= math.sqrt(np.sum(x * x))
    y -= np.sum(x * y) * x
    y /= math.sqrt(np.sum(y * y))
    turn[:, 0], turn[:, 1] = x, y
    turn[0, 2] = x[1] * y[2] - x[2] * y[1]
    turn[1, 2] = x[2] * y[0] - x[0] * y[2]
    turn[2, 2] = x[0] * y[1] - x[1] * y[0]
