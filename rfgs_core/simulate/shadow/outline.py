# SPDX-License-Identifier: Apache-2.0
"""The mesh of a body as its shadow needs it: few triangles, and the edges between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Detail of the mesh that casts shadows [m]; far below the first Fresnel zone of any preset.
DETAIL_M = 0.015


@dataclass(frozen=True)
class ShadowMesh:
    """Triangles with their edges."""

    faces: np.ndarray
    """Vertices of each triangle, int64, shape (T, 3)."""
    edges: np.ndarray
    """Vertices of each edge, every edge once, int64, shape (E, 2)."""
    edge_of: np.ndarray
    """Edges that each triangle goes along, int64, shape (T, 3): 2 · edge, and 1 more where the
    triangle goes along it backwards."""

    @classmethod
    def of(cls, faces: np.ndarray) -> ShadowMesh:
        """Finds the edges of triangles, shape (T, 3)."""
        faces = np.ascontiguousarray(faces, dtype=np.int64)
        ways = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
        edges, edge = np.unique(np.sort(ways, axis=1), axis=0, return_inverse=True)
        backwards = ways[:, 0] > ways[:, 1]
        return cls(faces, edges, (2 * edge.ravel() + backwards).reshape(-1, 3))


@dataclass(frozen=True)
class Outline:
    """What casts a shadow, and on what."""

    vertices: np.ndarray
    """Vertices [m], shape (V, 3)."""
    mesh: ShadowMesh
    """Triangles over them."""
    beside: np.ndarray
    """Which segments of the paths it may shade, bool, shape (path, segment)."""


def coarse_mesh(
    vertices: np.ndarray, faces: np.ndarray, detail_m: float = DETAIL_M
) -> tuple[np.ndarray, ShadowMesh]:
    """Thins out a mesh for its silhouette by joining vertices within cells.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        detail_m: Size of the cells [m].

    Returns:
        Indices of the vertices that are kept and triangles over them.
    """
    used = np.unique(faces)
    cells = np.floor(vertices[used].astype(np.float64) / detail_m).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.ravel()
    size = np.bincount(cell)
    mean = np.stack([np.bincount(cell, vertices[used, i]) / size for i in range(3)], axis=1)
    away = np.linalg.norm(vertices[used] - mean[cell], axis=1)
    order = np.lexsort((away, cell))
    kept = used[order[np.unique(cell[order], return_index=True)[1]]]
    of_vertex = np.zeros(len(vertices), dtype=np.int64)
    of_vertex[used] = cell
    thin = of_vertex[faces]
    flat = (thin[:, 0] == thin[:, 1]) | (thin[:, 1] == thin[:, 2]) | (thin[:, 2] == thin[:, 0])
    thin = thin[~flat]
    _, first = np.unique(np.sort(thin, axis=1), axis=0, return_index=True)
    return kept, ShadowMesh.of(thin[np.sort(first)])
