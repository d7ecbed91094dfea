# SPDX-License-Identifier: Apache-2.0
"""Curves over time: minimum jerk, slow noise, rotations and their blends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rfgs_core.articulated.turns import turn_of, vector_of

X, Y, Z = np.eye(3)


def minimum_jerk(share: np.ndarray) -> np.ndarray:
    """From 0 to 1 with the least jerk: 10 s³ - 15 s⁴ + 6 s⁵ (Flash and Hogan 1985).

    Args:
        share: Share of the time that has passed; beyond 0 and 1 it stands still.
    """
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def between(times: np.ndarray, start_s: float, end_s: float) -> np.ndarray:
    """Minimum jerk from 0 at `start_s` to 1 at `end_s`."""
    return minimum_jerk((times - start_s) / max(end_s - start_s, 1e-6))


def keyed(times: np.ndarray, knots_s: Sequence[float], values: np.ndarray) -> np.ndarray:
    """Values [N, …] at some times, with minimum jerk from each to the next."""
    values = np.asarray(values, np.float64)
    out = np.broadcast_to(values[0], (len(times), *values.shape[1:])).copy()
    for row in range(len(values) - 1):
        share = between(times, knots_s[row], knots_s[row + 1])
        shape = (len(times),) + (1,) * (values.ndim - 1)
        out += share.reshape(shape) * (values[row + 1] - values[row])
    return out


def keyed_turns(times: np.ndarray, knots_s: Sequence[float], turns: np.ndarray) -> np.ndarray:
    """Rotations [N, 3, 3] at some times, along the shortest arc from each to the next."""
    out = np.broadcast_to(turns[0], (len(times), 3, 3)).copy()
    for row in range(len(turns) - 1):
        share = between(times, knots_s[row], knots_s[row + 1])
        arc = vector_of(np.ascontiguousarray(turns[row].T @ turns[row + 1]))
        some = (times > knots_s[row]) & (share > 0.0)
        out[some] = turns[row] @ turned(share[some, None] * arc)
    return out


def turned(vectors: np.ndarray) -> np.ndarray:
    """Rotation matrices [T, 3, 3] of vectors [T, 3] in radians (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    axis = vectors / np.maximum(angle[..., 0], 1e-12)
    cross = np.zeros((*vectors.shape[:-1], 3, 3))
    cross[..., 0, 1], cross[..., 1, 0] = -axis[..., 2], axis[..., 2]
    cross[..., 0, 2], cross[..., 2, 0] = axis[..., 1], -axis[..., 1]
    cross[..., 1, 2], cross[..., 2, 1] = -axis[..., 0], axis[..., 0]
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)


def about(axis: np.ndarray, angles: np.ndarray | float) -> np.ndarray:
    """Rotation matrices [T, 3, 3] about one axis [3] by angles [T], or [3, 3] by one angle."""
    if np.ndim(angles) == 0:
        return turn_of(np.asarray(axis * angles, np.float64))
    return turned(np.asarray(angles)[:, None] * axis)


#: Waves of a slow wander.
_WAVES = 4


def noise(rng: np.random.Generator, times: np.ndarray, fastest_hz: float) -> np.ndarray:
    """A slow wander of about unit size [T]: a few waves of random frequency and phase."""
    hz = rng.uniform(0.05, fastest_hz, _WAVES)
    phase = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    size = rng.uniform(0.3, 1.0, _WAVES)
    size /= np.linalg.norm(size)
    return np.sin(2.0 * np.pi * hz * times[:, None] + phase) @ size


def smoothed(values: np.ndarray, rate_hz: float, width_s: float) -> np.ndarray:
    """Values [T, …] averaged by a bell of standard deviation `width_s`; ends are held."""
    reach = max(int(3.0 * width_s * rate_hz), 1)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (width_s * rate_hz)) ** 2)
    bell /= bell.sum()
    flat = values.reshape(len(values), -1)
    padded = np.concatenate([flat[:1].repeat(reach, 0), flat, flat[-1:].repeat(reach, 0)])
    columns = [np.convolve(column, bell, "valid") for column in padded.T]
    return np.stack(columns, axis=1).reshape(values.shape)
