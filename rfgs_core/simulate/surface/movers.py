# SPDX-License-Identifier: Apache-2.0
"""Meshes that move while their triangles stay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Movers:
    """Some of the triangles that move, over vertices of their own."""

    kept: np.ndarray
    """Their vertices as indices into all that move, int64, shape (V,)."""
    rest_vertices: np.ndarray
    """Vertices in the rest pose [m], float32, shape (V, 3)."""
    faces: np.ndarray
    """Triangles over `kept`, int64, shape (T, 3)."""
    material: np.ndarray
    """Material index of each triangle, int32, shape (T,)."""
    instance: np.ndarray
    """Instance id of each triangle, int32, shape (T,)."""
    segment: np.ndarray
    """Joint that each triangle follows or -1, int32, shape (T,)."""
    edges: np.ndarray
    """What the mesh says of each triangle's sides, as `Topology.edges`, int8, shape (T, 3)."""

    def __len__(self) -> int:
        return len(self.faces)

    @staticmethod
    def none() -> Movers:
        """Nothing that moves."""
        index = np.zeros(0, dtype=np.int64)
        small = index.astype(np.int32)
        corners = np.zeros((0, 3), dtype=np.int64)
        return Movers(
            kept=index,
            rest_vertices=np.zeros((0, 3), dtype=np.float32),
            faces=corners,
            material=small,
            instance=small,
            segment=small,
            edges=corners.astype(np.int8),
        )

    def posed(self, vertices: np.ndarray) -> np.ndarray:
        """Their share of all moving vertices [m], shape (V, 3)."""
        return vertices[self.kept]
