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
    """Vertices of each triangle, uint32, shape (T, 3); unsigned, so that kernels need not look for
    negative ones."""
    edges: np.ndarray
    """Vertices of each edge, uint32, shape (E, 2); once more for every further two triangles."""
    sides: np.ndarray
    """Triangles that go along each edge and backwards, T where there is none, uint32, (E, 2)."""

    @classmethod
    def of(cls, faces: np.ndarray) -> ShadowMesh:
        """Finds the edges of triangles, shape (T, 3)."""
        ways = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
        _, edge = np.unique(np.sort(ways, axis=1), axis=0, return_inverse=True)
        backwards = (ways[:, 0] > ways[:, 1]).astype(np.int64)
        # Triangles of one edge and direction are numbered: where vertices were joined, an edge may
        # have more than two.
        order = np.lexsort((backwards, edge.ravel()))
        group = 2 * edge.ravel()[order] + backwards[order]
        number = np.arange(len(group)) - np.searchsorted(group, group)
        keys, slot = np.unique(np.stack([group // 2, number], axis=1), axis=0, return_inverse=True)
        sides = np.full((len(keys), 2), len(faces), dtype=np.uint32)
        sides[slot.ravel(), group % 2] = order // 3
        edges = np.zeros((len(keys), 2), dtype=np.uint32)
        edges[slot.ravel()] = np.sort(ways[order], axis=1)
        return cls(np.ascontiguousarray(faces, dtype=np.uint32), edges, sides)


@dataclass(frozen=True)
class Outline:
    """What casts a shadow, and on what."""

    vertices: np.ndarray
    """Vertices [m], shape (V, 3)."""
    mesh: ShadowMesh
    """Triangles over them."""
    in_view: np.ndarray
    """Which segments of the paths it may shade, bool, shape (path, segment)."""


def coarse_mesh(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, ShadowMesh]:
    """Thins out a mesh for its silhouette by joining vertices within cells.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles, shape (T, 3).

    Returns:
        Indices of the vertices that are kept and triangles over them.
    """
    used = np.unique(faces)
    cells = np.floor(vertices[used].astype(np.float64) / DETAIL_M).astype(np.int64)
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
