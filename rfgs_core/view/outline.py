# SPDX-License-Identifier: Apache-2.0
"""A surface as thin lines: where level planes cut it, so that nobody takes it for a result."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float32

from rfgs_core.view.frame import Mesh

#: Height between two planes [m].
SPACING_M = 0.06


def level_lines(mesh: Mesh, spacing_m: float = SPACING_M) -> Float32[np.ndarray, "line 2 3"]:
    """Cuts a mesh with level planes.

    Args:
        mesh: The surface; planes stand at whole multiples of the spacing, whatever it does.
        spacing_m: Height between two planes [m].

    Returns:
        One line per triangle and plane that meet [m].
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    if not len(corners):
        return np.zeros((0, 2, 3), np.float32)
    # Halfway between multiples, as feet stand on the floor and boxes end at round numbers.
    height = corners[..., 2] / spacing_m - 0.5
    first = np.ceil(height.min(axis=1)).astype(int)
    count = np.maximum(np.floor(height.max(axis=1)).astype(int) - first + 1, 0)
    face = np.repeat(np.arange(len(corners)), count)
    plane = first[face] + np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    above = height[face] - plane[:, None]
    cut = corners[face]
    ends = np.zeros((len(face), 3, 3))
    crossed = np.zeros((len(face), 3), bool)
    for edge in range(3):
        low, high = above[:, edge], above[:, (edge + 1) % 3]
        crossed[:, edge] = (low < 0) != (high < 0)
        share = np.divide(low, low - high, out=np.zeros_like(low), where=low != high)
        ends[:, edge] = cut[:, edge] + share[:, None] * (cut[:, (edge + 1) % 3] - cut[:, edge])
    crosses = crossed.sum(axis=1) == 2
    return ends[crosses][crossed[crosses]].reshape(-1, 2, 3).astype(np.float32)
