# SPDX-License-Identifier: Apache-2.0
"""Rays and segments through a hierarchy of triangles, in double precision."""

from __future__ import annotations

import math

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh

#: Deepest tree that a traversal has room for.
_STACK = 64
#: Triangles reach this far beyond their edges, as a share of them: no ray slips through a seam.
_SEAM = 1e-9


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
    inverse = _inverse(wx), _inverse(wy), _inverse(wz)
    reach = length - rim_m
    box, first, count, corners = bvh.box, bvh.first, bvh.count, bvh.corners
    stack = np.zeros(_STACK, dtype=np.int64)
    size, found = 1, 0
    while size:
        size -= 1
        node = stack[size]
        if not _enters(box[node], (x, y, z), inverse, reach):
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
def nearest(
    bvh: Bvh, start: np.ndarray, way: np.ndarray, rim_m: float, stack: np.ndarray
) -> tuple[float, int]:
    """Distance of the first triangle that a ray meets [m], and which; infinite and −1 for none.

    Args:
        bvh: The triangles.
        start: Where it starts [m], shape (3,).
        way: Where to, a unit vector, shape (3,).
        rim_m: What is nearer than this does not count [m].
        stack: Scratch, from `new_stack`.
    """
    x, y, z, wx, wy, wz = start[0], start[1], start[2], way[0], way[1], way[2]
    inverse = _inverse(wx), _inverse(wy), _inverse(wz)
    box, first, count, corners = bvh.box, bvh.first, bvh.count, bvh.corners
    stack[0], size, best, found = 0, 1, np.inf, -1
    while size:
        size -= 1
        node = stack[size]
        if not _enters(box[node], (x, y, z), inverse, best):
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


@numba.njit(cache=True, nogil=True)
def new_stack() -> np.ndarray:
    """Scratch for many calls of `nearest` and `blocked`."""
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
    inverse = _inverse(wx), _inverse(wy), _inverse(wz)
    reach = length - rim_m
    box, first, count, corners = bvh.box, bvh.first, bvh.count, bvh.corners
    stack[0], size = 0, 1
    while size:
        size -= 1
        node = stack[size]
        # Children are looked at before they are kept: most of them are missed.
        if count[node] == 0 and len(first) > 1:
            for child in range(first[node], first[node] + 2):
                if _enters(box[child], (x, y, z), inverse, reach):
                    stack[size] = child
                    size += 1
            continue
        for i in range(first[node], first[node] + count[node]):
            if rim_m < _hit(corners, i, x, y, z, wx, wy, wz) < reach:
                return True
    return False


@numba.njit(cache=True, nogil=True, inline="always")
def _inverse(part: float) -> float:
    """1 / part, large where there is none."""
    return 1.0 / part if abs(part) > 1e-15 else 1e15


@numba.njit(cache=True, nogil=True, inline="always")
def _enters(
    box: np.ndarray,
    start: tuple[float, float, float],
    inverse: tuple[float, float, float],
    reach: float,
) -> bool:
    """Whether a ray of some reach enters a node's box."""
    # What is entered first along an axis depends on the sign of the ray alone.
    x = 0 if inverse[0] > 0.0 else 3
    y = 0 if inverse[1] > 0.0 else 3
    z = 0 if inverse[2] > 0.0 else 3
    near = max((box[x] - start[0]) * inverse[0], (box[1 + y] - start[1]) * inverse[1])
    near = max(near, max((box[2 + z] - start[2]) * inverse[2], 0.0))
    far = min((box[3 - x] - start[0]) * inverse[0], (box[4 - y] - start[1]) * inverse[1])
    return near <= min(far, min((box[5 - z] - start[2]) * inverse[2], reach))


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
    share = 1.0 / det
    sx, sy, sz = x - ax, y - ay, z - az
    u = (sx * px + sy * py + sz * pz) * share
    if u < -_SEAM or u > 1.0 + _SEAM:
        return -1.0
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    v = (wx * qx + wy * qy + wz * qz) * share
    if v < -_SEAM or u + v > 1.0 + _SEAM:
        return -1.0
    return (vx * qx + vy * qy + vz * qz) * share
