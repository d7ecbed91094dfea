# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotation matrices for the gait."""

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


def _frame(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    first = direction / np.linalg.norm(direction)
    second = hinge - first * (hinge @ first)
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)], axis=1)
