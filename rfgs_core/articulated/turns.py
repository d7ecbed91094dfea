# SPDX-License-Identifier: Apache-2.0
"""Rotations as vectors and matrices, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: Compiled once and kept on disk: importing programs start at once.
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**OPTIONS)
def turn_of(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix [3, 3] by the angle |vector| [rad] about `vector` [3] (Rodrigues)."""
    x, y, z = vector[0], vector[1], vector[2]
    angle2 = x * x + y * y + z * z
    if angle2 < 1e-12:
        a, b = 1.0, 0.5
    else:
        angle = math.sqrt(angle2)
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    out = np.zeros((3, 3))
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x
    return out


@njit(**OPTIONS)
def vector_of(turn: np.ndarray) -> np.ndarray:
    """The vector [3] of a rotation matrix [3, 3], of length at most pi [rad]."""
    out = np.zeros(3)
    out[0] = 0.5 * (turn[2, 1] - turn[1, 2])
    out[1] = 0.5 * (turn[0, 2] - turn[2, 0])
    out[2] = 0.5 * (turn[1, 0] - turn[0, 1])
    sine = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    cosine = 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0)
    angle = math.atan2(sine, cosine)
    if sine > 1e-6:
        return out * (angle / sine)
    if cosine > 0.0:
        return out
    # Half a turn: the axis is the largest column of (R + 1) / 2.
    best = 0
    for axis in range(1, 3):
        if turn[axis, axis] > turn[best, best]:
            best = axis
    column = turn[:, best].copy()
    column[best] += 1.0
    return column * (angle / math.sqrt(column[0] ** 2 + column[1] ** 2 + column[2] ** 2))


@njit(**OPTIONS)
def chained(parents: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Rotations against the world [B, 3, 3] from those against the parents [B, 3, 3]."""
    out = local.copy()
    for bone in range(len(parents)):
        if parents[bone] >= 0:
            out[bone] = multiplied(out[parents[bone]], local[bone])
    return out


@njit(**OPTIONS)
def multiplied(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Product of two matrices [3, 3], without the overhead of a library call."""
    out = np.zeros((3, 3))
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += first[row, k] * second[k, column]
            out[row, column] = total
    return out
