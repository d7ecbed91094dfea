# SPDX-License-Identifier: Apache-2.0
"""Where a surface is smooth and where it has an edge: normals and cells stop at edges.

A normal that is averaged across the edge of a box belongs to neither of its faces. Which sides
of triangles are edges is the mesh's own word where it has one, else a matter of the angle
between triangles in the rest pose. Everything here is about welded vertices, so that a seam,
where an exporter has doubled the vertices, is no edge by itself.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

#: What a mesh says of a triangle's side: nothing, that the surface is smooth across it, that it
#: has an edge there.
UNSAID, SMOOTH, SHARP = -1, 0, 1
#: Triangles that meet at a larger angle have an edge between them, unless the mesh says
#: otherwise [deg]: less than the 45° of a bevelled edge, more than the 36° between the sides of
#: a limb of ten.
EDGE_DEG = 40.0
#: Triangles that meet at a larger angle are the two sides of a sheet, whatever the mesh says.
_FOLDED_DEG = 170.0
#: Triangles at one edge that are compared with each other; a sheet of two layers has four.
_MOST_AT_AN_EDGE = 4


def smooth_sides(vertices: np.ndarray, faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Pairs of triangle sides across which the surface is smooth.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles over welded vertices, wound alike, shape (T, 3).
        edges: What the mesh says of each side, as `Topology.edges`, shape (T, 3).

    Returns:
        Sides as 3 · triangle + first corner, int64, shape (pair, 2).
    """
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    order = order[ends[order, 0] != ends[order, 1]]
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for step in range(1, _MOST_AT_AN_EDGE):
        first, second = order[:-step], order[step:]
        same = (ends[first] == ends[second]).all(axis=1)
        pairs.append(np.stack([first[same], second[same]], axis=1))
    pairs = np.concatenate(pairs)
    said = edges.reshape(-1)[pairs]
    largest_deg = np.where((said == SMOOTH).all(axis=1), _FOLDED_DEG, EDGE_DEG)
    smooth = _meet_below(vertices, faces, pairs // 3, largest_deg)
    return pairs[smooth & ~(said == SHARP).any(axis=1)]


def corner_normals(faces: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Which corners of triangles share a normal: those around a vertex with no edge between.

    Args:
        faces: As `smooth_sides` takes them, shape (T, 3).
        pairs: Smooth sides, from `smooth_sides`.

    Returns:
        Index of each corner's normal, int64, from 0 without gaps, shape (T, 3).
    """
    start, end = pairs, pairs // 3 * 3 + (pairs + 1) % 3
    corner = faces.reshape(-1)
    turned = corner[start[:, 0]] != corner[start[:, 1]]
    rows = np.concatenate([start[:, 0], end[:, 0]])
    cols = np.concatenate(
        [np.where(turned, end[:, 1], start[:, 1]), np.where(turned, start[:, 1], end[:, 1])]
    )
    return _connected(rows, cols, faces.size).reshape(faces.shape)


def smooth_patches(pairs: np.ndarray, count: int) -> np.ndarray:
    """Patch of each of `count` triangles: what edges part from the rest, int64, shape (T,)."""
    return _connected(pairs[:, 0] // 3, pairs[:, 1] // 3, count)


def _meet_below(
    vertices: np.ndarray, faces: np.ndarray, pairs: np.ndarray, largest_deg: np.ndarray
) -> np.ndarray:
    """Whether two triangles meet at less than an angle; triangles without area always do."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    size = np.linalg.norm(across, axis=1)
    cosine = np.einsum("px,px->p", across[pairs[:, 0]], across[pairs[:, 1]])
    return cosine >= np.cos(np.radians(largest_deg)) * size[pairs[:, 0]] * size[pairs[:, 1]]


def _connected(rows: np.ndarray, cols: np.ndarray, count: int) -> np.ndarray:
    graph = coo_matrix((np.ones(len(rows), dtype=bool), (rows, cols)), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)
