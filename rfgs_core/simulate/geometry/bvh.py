# SPDX-License-Identifier: Apache-2.0
"""What a straight segment crosses: a bounding volume hierarchy over triangles, in double."""

from __future__ import annotations

import math
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
#: Triangles reach this far beyond their edges, as a share of them: no ray slips through a seam.
_SEAM = 1e-9


class Bvh(NamedTuple):
    """Triangles in the order of the leaves, and the boxes around them."""

    corners: np.ndarray
    """Corners of the triangles [m], shape (triangle, 3, 3)."""
    triangle: np.ndarray
    """Index of each among those given, shape (triangle,)."""
    low: np.ndarray
    """Lower corner of each node's box [m], shape (node, 3)."""
    high: np.ndarray
    """Upper corner of each node's box [m], shape (node, 3)."""
    first: np.ndarray
    """First triangle of a leaf; left child of other nodes, the right one follows it."""
    count: np.ndarray
    """Triangles of a leaf, 0 for other nodes."""


def build_bvh(triangles: Float64[np.ndarray, "triangle 3 3"]) -> Bvh:
    """Hierarchy over triangles, halved along the longest axis of their centres."""
    triangles = np.ascontiguousarray(triangles, dtype=np.float64)
    order, low, high, first, count = _built(triangles)
    return Bvh(triangles[order], order, low, high, first, count)


@numba.njit(cache=True, nogil=True)
def new_stack() -> np.ndarray:
    """Scratch for many calls of `blocked`."""
    return np.zeros(_STACK, dtype=np.int64)


@numba.njit(cache=True, nogil=True)
def blocked(bvh: Bvh, start: np.ndarray, end: np.ndarray, rim_m: float, stack: np.ndarray) -> bool:
    """Whether a segment crosses any triangle, as `crossings` tells, looking no further.

    Args:
        bvh: The triangles.
        start: Where it starts [m], shape (3,).
        end: Where it leads to [m], shape (3,).
        rim_m: What is nearer to either end does not count [m].
        stack: Scratch, from `new_stack`.
    """
    x, y, z = start[0], start[1], start[2]
    wx, wy, wz = end[0] - x, end[1] - y, end[2] - z
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    if length <= 2.0 * rim_m:
        return False
    wx, wy, wz = wx / length, wy / length, wz / length
    inverse_x, inverse_y, inverse_z = _inverse(wx), _inverse(wy), _inverse(wz)
    reach = length - rim_m
    low, high, first, count, corners = bvh.low, bvh.high, bvh.first, bvh.count, bvh.corners
    stack[0], size = 0, 1
    while size:
        size -= 1
        node = stack[size]
        near, far = _within(low[node, 0], high[node, 0], x, inverse_x, 0.0, reach)
        near, far = _within(low[node, 1], high[node, 1], y, inverse_y, near, far)
        near, far = _within(low[node, 2], high[node, 2], z, inverse_z, near, far)
        if near > far:
            continue
        if count[node] == 0 and len(first) > 1:
            stack[size], stack[size + 1] = first[node] + 1, first[node]
            size += 2
            continue
        for i in range(first[node], first[node] + count[node]):
            if rim_m < _hit(corners, i, x, y, z, wx, wy, wz) < reach:
                return True
    return False


@numba.njit(cache=True, nogil=True)
def refit(bvh: Bvh, triangles: np.ndarray) -> Bvh:
    """The same hierarchy over triangles that have moved a little, its boxes drawn anew.

    Args:
        bvh: The hierarchy.
        triangles: Corners in the order that it was built from [m], shape (triangle, 3, 3).
    """
    corners = triangles[bvh.triangle]
    low, high = np.full_like(bvh.low, np.inf), np.full_like(bvh.high, -np.inf)
    for node in range(len(bvh.first) - 1, -1, -1):
        if bvh.count[node] == 0 and len(bvh.first) > 1:
            for child in range(bvh.first[node], bvh.first[node] + 2):
                for axis in range(3):
                    low[node, axis] = min(low[node, axis], low[child, axis])
                    high[node, axis] = max(high[node, axis], high[child, axis])
            continue
        for i in range(bvh.first[node], bvh.first[node] + bvh.count[node]):
            for corner in range(3):
                for axis in range(3):
                    low[node, axis] = min(low[node, axis], corners[i, corner, axis])
                    high[node, axis] = max(high[node, axis], corners[i, corner, axis])
    return Bvh(corners, bvh.triangle, low, high, bvh.first, bvh.count)


@numba.njit(cache=True)
def _built(
    triangles: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Order of the triangles, boxes, and first and count of each node."""
    total = len(triangles)
    order = np.arange(total)
    centre = np.zeros((total, 3))
    for i in range(total):
        for axis in range(3):
            corners = triangles[i, :, axis]
            centre[i, axis] = 0.5 * (corners.min() + corners.max())
    room = max(2 * total, 1)
    low, high = np.full((room, 3), np.inf), np.full((room, 3), -np.inf)
    first, count = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
    ends = np.zeros((room, 2), dtype=np.int64)
    ends[0, 1] = total
    node, nodes = 0, 1
    while node < nodes:
        begin, end = ends[node]
        for i in order[begin:end]:
            for axis in range(3):
                low[node, axis] = min(low[node, axis], triangles[i, :, axis].min())
                high[node, axis] = max(high[node, axis], triangles[i, :, axis].max())
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
    return order, low[:nodes], high[:nodes], first[:nodes], count[:nodes]


@numba.njit(cache=True, nogil=True)
def crossings(
    bvh: Bvh,
    start: np.ndarray,
    end: np.ndarray,
    rim_m: float,
    at_m: np.ndarray,
    triangle: np.ndarray,
) -> int:
    """Surfaces that a segment crosses, nearest first.

    Args:
        bvh: The triangles.
        start: Where it starts [m], shape (3,).
        end: Where it leads to [m], shape (3,).
        rim_m: What is nearer to either end does not count [m].
        at_m: Filled with the distance of each crossing from the start [m].
        triangle: Filled with the triangle of each, the smallest of several at one place.

    Returns:
        Number of crossings; more than fit into `at_m` count as one more than that.
    """
    x, y, z = start[0], start[1], start[2]
    wx, wy, wz = end[0] - x, end[1] - y, end[2] - z
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    if length <= 2.0 * rim_m:
        return 0
    wx, wy, wz = wx / length, wy / length, wz / length
    inverse_x, inverse_y, inverse_z = _inverse(wx), _inverse(wy), _inverse(wz)
    reach = length - rim_m
    low, high, first, count, corners = bvh.low, bvh.high, bvh.first, bvh.count, bvh.corners
    stack = np.zeros(_STACK, dtype=np.int64)
    size, found = 1, 0
    while size:
        size -= 1
        node = stack[size]
        near, far = _within(low[node, 0], high[node, 0], x, inverse_x, 0.0, reach)
        near, far = _within(low[node, 1], high[node, 1], y, inverse_y, near, far)
        near, far = _within(low[node, 2], high[node, 2], z, inverse_z, near, far)
        if near > far:
            continue
        if count[node] == 0 and len(first) > 1:
            stack[size], stack[size + 1] = first[node] + 1, first[node]
            size += 2
            continue
        for i in range(first[node], first[node] + count[node]):
            at = _hit(corners, i, x, y, z, wx, wy, wz)
            if at <= rim_m or at >= reach:
                continue
            found = _insert(at, bvh.triangle[i], at_m, triangle, found)
            if found > len(at_m):
                return found
    return found


@numba.njit(cache=True, nogil=True)
def nearest(bvh: Bvh, start: np.ndarray, way: np.ndarray, rim_m: float) -> tuple[float, int]:
    """Distance of the first triangle that a ray meets [m], and which; infinite and −1 for none.

    Args:
        bvh: The triangles.
        start: Where it starts [m], shape (3,).
        way: Where to, a unit vector, shape (3,).
        rim_m: What is nearer than this does not count [m].
    """
    x, y, z, wx, wy, wz = start[0], start[1], start[2], way[0], way[1], way[2]
    inverse_x, inverse_y, inverse_z = _inverse(wx), _inverse(wy), _inverse(wz)
    low, high, first, count, corners = bvh.low, bvh.high, bvh.first, bvh.count, bvh.corners
    stack = np.zeros(_STACK, dtype=np.int64)
    size, best, found = 1, np.inf, -1
    while size:
        size -= 1
        node = stack[size]
        near, far = _within(low[node, 0], high[node, 0], x, inverse_x, 0.0, best)
        near, far = _within(low[node, 1], high[node, 1], y, inverse_y, near, far)
        near, far = _within(low[node, 2], high[node, 2], z, inverse_z, near, far)
        if near > far:
            continue
        if count[node] == 0 and len(first) > 1:
            stack[size], stack[size + 1] = first[node] + 1, first[node]
            size += 2
            continue
        for i in range(first[node], first[node] + count[node]):
            at = _hit(corners, i, x, y, z, wx, wy, wz)
            if rim_m < at < best:
                best, found = at, bvh.triangle[i]
    return best, found


@numba.njit(cache=True, nogil=True, inline="always")
def _inverse(part: float) -> float:
    """1 / part, large where there is none."""
    return 1.0 / part if abs(part) > 1e-15 else 1e15


@numba.njit(cache=True, nogil=True, inline="always")
def _within(
    low: float, high: float, start: float, inverse: float, near: float, far: float
) -> tuple[float, float]:
    """The part of a segment from `near` to `far` that lies between two planes, with a margin."""
    a, b = (low - SAME_M - start) * inverse, (high + SAME_M - start) * inverse
    return max(near, min(a, b)), min(far, max(a, b))


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
            outside |= place[axis] < bvh.low[node, axis] - SAME_M
            outside |= place[axis] > bvh.high[node, axis] + SAME_M
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


@numba.njit(cache=True, nogil=True)
def _insert(at: float, index: int, at_m: np.ndarray, triangle: np.ndarray, found: int) -> int:
    """Puts a crossing in its place among those found; returns how many there are then."""
    for i in range(found):
        if abs(at_m[i] - at) <= SAME_M:
            triangle[i] = min(triangle[i], index)
            return found
    if found == len(at_m):
        return found + 1
    place = found
    while place > 0 and at_m[place - 1] > at:
        at_m[place], triangle[place] = at_m[place - 1], triangle[place - 1]
        place -= 1
    at_m[place], triangle[place] = at, index
    return found + 1


@numba.njit(cache=True, nogil=True, inline="always")
def _hit(
    corners: np.ndarray,
    i: int,
    x: float,
    y: float,
    z: float,
    wx: float,
    wy: float,
    wz: float,
) -> float:
    """Distance at which a ray meets triangle i, −1 if not (Möller and Trumbore 1997)."""
    ax, ay, az = corners[i, 0, 0], corners[i, 0, 1], corners[i, 0, 2]
    ux, uy, uz = corners[i, 1, 0] - ax, corners[i, 1, 1] - ay, corners[i, 1, 2] - az
    vx, vy, vz = corners[i, 2, 0] - ax, corners[i, 2, 1] - ay, corners[i, 2, 2] - az
    px, py, pz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    det = ux * px + uy * py + uz * pz
    if det == 0.0:
        return -1.0
    sx, sy, sz = x - ax, y - ay, z - az
    u = (sx * px + sy * py + sz * pz) / det
    if u < -_SEAM or u > 1.0 + _SEAM:
        return -1.0
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    v = (wx * qx + wy * qy + wz * qz) / det
    if v < -_SEAM or u + v > 1.0 + _SEAM:
        return -1.0
    return (vx * qx + vy * qy + vz * qz) / det
