# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations as matrices and unit quaternions."""

from __future__ import annotations

import numpy as np


def about_x(angle: float) -> np.ndarray:
    """Rotation about +x by `angle` [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def about_y(angle: float) -> np.ndarray:
    """Rotation about +y by `angle` [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def about_z(angle: float) -> np.ndarray:
    """Rotation about +z by `angle` [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about any `axis` by `angle` [rad] (Rodrigues' formula)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def frame_between(
    rest: np.ndarray, rest_hinge: np.ndarray, posed: np.ndarray, hinge: np.ndarray
) -> np.ndarray:
    """Rotation that takes direction `rest` to `posed` and the hinge axis along with it."""
    return _frame(posed, hinge) @ _frame(rest, rest_hinge).T


def smoothstep(share: float) -> float:
    """Smooth step from 0 to 1 with level ends; `share` is clipped to [0, 1]."""
    u = min(max(share, 0.0), 1.0)
    return u * u * (3 - 2 * u)


def quaternions(turns: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4), w first and not negative, of rotation matrices (..., 3, 3)."""
    m = np.asarray(turns, dtype=np.float64)
    trace = np.einsum("...ii", m)
    # Bar-Itzhack: the quaternion spans the largest eigenvector of this symmetric matrix.
    k = np.zeros((*m.shape[:-2], 4, 4))
    k[..., 0, 0] = trace
    k[..., 1:, 1:] = m + np.swapaxes(m, -1, -2) - trace[..., None, None] * np.eye(3)
    for axis, (row, column) in enumerate(((2, 1), (0, 2), (1, 0)), start=1):
        k[..., 0, axis] = k[..., axis, 0] = m[..., row, column] - m[..., column, row]
    out = np.linalg.eigh(k)[1][..., -1]
    return out * np.where(out[..., :1] < 0, -1.0, 1.0)


def matrices(quats: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4), w first."""
    w, x, y, z = np.moveaxis(np.asarray(quats, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def slerp(first: np.ndarray, second: np.ndarray, share: float) -> np.ndarray:
    """Shortest way between unit quaternions (..., 4); `share` 0 gives the first."""
    cosine = (first * second).sum(axis=-1, keepdims=True)
    second, cosine = np.where(cosine < 0, -second, second), np.minimum(np.abs(cosine), 1.0)
    angle = np.arccos(cosine)
    sine = np.sin(angle)
    near = sine < 1e-6
    safe = np.where(near, 1.0, sine)
    a = np.where(near, 1 - share, np.sin((1 - share) * angle) / safe)
    b = np.where(near, share, np.sin(share * angle) / safe)
    out = a * first + b * second
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def _frame(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    first = direction / np.linalg.norm(direction)
    second = hinge - first * (hinge @ first)
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)], axis=1)
