# SPDX-License-Identifier: Apache-2.0
"""The straight line that a path with mirrors unfolds to, seen from each of its segments."""

from __future__ import annotations

import numpy as np

from rfgs_core.simulate.paths.path_set import PathSet


def unfold(paths: PathSet) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where each segment lies on its unfolded line, and how offsets of the ends appear there.

    A scattering point starts a new line: beyond it the transmitter's elements are one point.

    Returns:
        Length before and after each segment [m], shape (path, depth + 1), and matrices that
        take offsets of TX and RX elements to the segment, shape (path, depth + 1, 3, 3).
    """
    steps = np.diff(paths.vertices, axis=1)
    length = np.linalg.norm(steps, axis=2)
    k = steps / np.maximum(length, 1e-12)[:, :, None]
    count, segments = length.shape
    before, after = np.zeros((count, segments)), np.zeros((count, segments))
    tx_turn = np.broadcast_to(np.eye(3), (count, segments, 3, 3)).copy()
    rx_turn = tx_turn.copy()
    breaks = paths.breaks()
    reflect = _reflections(paths, k)
    for i in range(segments - 1):
        broken = breaks[:, i]
        before[:, i + 1] = np.where(broken, 0.0, before[:, i] + length[:, i])
        turned = reflect[:, i] @ tx_turn[:, i]
        tx_turn[:, i + 1] = np.where(broken[:, None, None], 0.0, turned)
    for i in range(segments - 2, -1, -1):
        broken = breaks[:, i]
        after[:, i] = np.where(broken, 0.0, after[:, i + 1] + length[:, i + 1])
        turned = reflect[:, i] @ rx_turn[:, i + 1]
        rx_turn[:, i] = np.where(broken[:, None, None], 0.0, turned)
    return before, after, tx_turn, rx_turn


def _reflections(paths: PathSet, k: np.ndarray) -> np.ndarray:
    """Mirror matrix of each interaction, the identity where nothing bends (path, depth, 3, 3)."""
    normal = k[:, 1:] - k[:, :-1]
    size = np.linalg.norm(normal, axis=2)
    bends = paths.mirrors() & (size > 1e-9)
    normal = np.where(bends[:, :, None], normal / np.maximum(size, 1e-12)[:, :, None], 0.0)
    return np.eye(3) - 2.0 * normal[..., :, None] * normal[..., None, :]
