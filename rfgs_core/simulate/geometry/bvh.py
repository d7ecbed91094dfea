# SPDX-License-Identifier: Apache-2.0
"""A bounding volume hierarchy over triangles, in double precision."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Float64

#: Crossings nearer to each other than this are one: shared edges, surfaces laid on each other [m].
SAME_M = 1e-6
#: Most triangles of a leaf.
_LEAF = 4
#: Deepest tree that a traversal has room for.
_STACK = 64


class Bvh(NamedTuple):
    """Triangles in the order of the leaves, and the boxes around them."""

    corners: np.ndarray
    """Corners of the triangles [m], shape (triangle, 3, 3)."""
    triangle: np.ndarray
    """Index of each among those given, shape (triangle,)."""
    box: np.ndarray
    """Lower and upper corner of each node's box, `SAME_M` around it [m], shape (node, 6)."""
    first: np.ndarray
    """First triangle of a leaf; left child of other nodes, the right one follows it; uint32."""
    count: np.ndarray
    """Triangles of a leaf, 0 for other nodes; uint32."""


def build_bvh(triangles: Float64[np.ndarray, "triangle 3 3"]) -> Bvh:
    """Hierarchy over triangles, halved along the longest axis of their centres."""
    triangles = np.ascontiguousarray(triangles, dtype=np.float64)
    return Bvh(*_built(triangles))


@numba.njit(cache=True, nogil=True)
def refit(bvh: Bvh, triangles: np.ndarray) -> Bvh:
    """The same hierarchy over triangles that have moved a little, its boxes drawn anew.

    Args:
        bvh: The hierarchy.
        triangles: Corners in the order that it was built from [m], shape (triangle, 3, 3).
    """
    corners = triangles[bvh.triangle]
    return Bvh(corners, bvh.triangle, _boxes(corners, bvh.first, bvh.count), bvh.first, bvh.count)


@numba.njit(cache=True, nogil=True)
def _boxes(corners: np.ndarray, first: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Boxes of all nodes: children stand behind their parents."""
    box = np.zeros((len(first), 6))
    box[:, :3], box[:, 3:] = np.inf, -np.inf
    for node in range(len(first) - 1, -1, -1):
        begin = first[node]
        if count[node] == 0 and len(first) > 1:
            for axis in range(3):
                box[node, axis] = min(box[begin, axis], box[begin + 1, axis])
                box[node, 3 + axis] = max(box[begin, 3 + axis], box[begin + 1, 3 + axis])
            continue
        for i in range(begin, begin + count[node]):
            for corner in range(3):
                for axis in range(3):
                    at = corners[i, corner, axis]
                    box[node, axis] = min(box[node, axis], at - SAME_M)
                    box[node, 3 + axis] = max(box[node, 3 + axis], at + SAME_M)
    return box


@numba.njit(cache=True)
def _built(
    triangles: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What a `Bvh` is made of."""
    total = len(triangles)
    order = np.arange(total)
    centre = np.zeros((total, 3))
    for i in range(total):
        for axis in range(3):
            corners = triangles[i, :, axis]
            centre[i, axis] = 0.5 * (corners.min() + corners.max())
    room = max(2 * total, 1)
    first, count = np.zeros(room, dtype=np.uint32), np.zeros(room, dtype=np.uint32)
    ends = np.zeros((room, 2), dtype=np.int64)
    ends[0, 1] = total
    node, nodes = 0, 1
    while node < nodes:
        begin, end = ends[node]
        if end - begin <= _LEAF:
            first[node], count[node] = begin, end - begin
        else:
            here = order[begin:end].copy()
            axis, widest = 0, -1.0
            for a in range(3):
                along = centre[here, a]
                if along.max() - along.min() > widest:
                    axis, widest = a, along.max() - along.min()
            # Sorted all the way, so that equal centres split the same on every machine.
            order[begin:end] = here[np.argsort(centre[here, axis], kind="mergesort")]
            middle = (begin + end) // 2
            first[node] = nodes
            ends[nodes, 0], ends[nodes, 1] = begin, middle
            ends[nodes + 1, 0], ends[nodes + 1, 1] = middle, end
            nodes += 2
        node += 1
    first, count, corners = first[:nodes], count[:nodes], triangles[order]
    return corners, order, _boxes(corners, first, count), first, count


@numba.njit(cache=True, nogil=True)
def triangle_at(bvh: Bvh, group: np.ndarray, wanted: int, place: np.ndarray) -> int:
    """Smallest triangle of a group that a place in its plane lies on, rim included; −1 for none.

    Args:
        bvh: The triangles.
        group: Group of each triangle, shape (triangle,).
        wanted: Which group.
        place: The place [m], shape (3,).
    """
    stack = np.zeros(_STACK, dtype=np.int64)
    size, best = 1, -1
    while size:
        size -= 1
        node = stack[size]
        outside = False
        for axis in range(3):
            outside |= place[axis] < bvh.box[node, axis]
            outside |= place[axis] > bvh.box[node, 3 + axis]
        if outside:
            continue
        if bvh.count[node] == 0 and len(bvh.first) > 1:
            stack[size], stack[size + 1] = bvh.first[node] + 1, bvh.first[node]
            size += 2
            continue
        for i in range(bvh.first[node], bvh.first[node] + bvh.count[node]):
            index = bvh.triangle[i]
            if group[index] == wanted and (best < 0 or index < best):
                if _lies_on(bvh.corners[i], place):
                    best = index
    return best


@numba.njit(cache=True, nogil=True)
def _lies_on(corners: np.ndarray, place: np.ndarray) -> bool:
    """Whether a place in the plane of a triangle is within `SAME_M` of it."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal = normal / np.sqrt((normal * normal).sum())
    for i in range(3):
        side = corners[(i + 1) % 3] - corners[i]
        inward = np.cross(normal, side)
        over = ((place - corners[i]) * inward).sum() / np.sqrt((side * side).sum())
        if over < -SAME_M:
            return False
    return True
