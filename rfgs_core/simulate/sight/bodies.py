# SPDX-License-Identifier: Apache-2.0
"""What bodies hide from a place: triangles drawn as seen from there, the nearest one kept.

A picture alone would be as coarse as its pixels. Here every triangle fills all pixels it touches,
so that a point is surely in sight where nothing drawn is nearer. Where something is, the nearest
triangle is met exactly, and a ray through all of them decides what is left.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh, crossings

#: Pixels along a side.
SIZE = 192
#: What is drawn nearer than a point by less than this is the point's own surface [m].
_OWN_M = 2e-3
#: What is nearer than this to a place cannot be drawn from there [m].
_NEAREST_M = 0.02
#: Widest view of a picture, as the tangent of half its angle.
_WIDEST = 4.0


class Picture(NamedTuple):
    """Bodies as seen from a place."""

    place: np.ndarray
    """Where [m], shape (3,)."""
    axes: np.ndarray
    """Right, up and forward, unit vectors, shape (3, 3)."""
    per_pixel: float
    """Width of a pixel at a distance of 1."""
    nearest: np.ndarray
    """Nearest triangle of each pixel, −1 for none, int32, shape (row, column)."""
    depth: np.ndarray
    """One over its distance along forward, 0 for none [1/m], float32, shape (row, column)."""


@numba.njit(cache=True, nogil=True)
def picture(
    triangles: np.ndarray, place: np.ndarray, centre: np.ndarray, radius: float, size: int
) -> Picture:
    """Draws triangles from a place, looking at a ball.

    Args:
        triangles: Corners [m], shape (triangle, 3, 3).
        place: Where from [m], shape (3,).
        centre: Middle of the ball [m], shape (3,).
        radius: Its radius [m].
        size: Pixels along a side.
    """
    axes = _facing(centre - place)
    d = math.sqrt(((centre - place) ** 2).sum())
    reach = radius / math.sqrt(d * d - radius * radius) if d > 1.03 * radius else _WIDEST
    per_pixel = 2.0 * min(1.02 * reach, _WIDEST) / size
    nearest = np.full((size, size), -1, dtype=np.int32)
    depth = np.zeros((size, size), dtype=np.float32)
    seen = np.zeros((3, 3))
    for t in range(len(triangles)):
        ahead = True
        for c in range(3):
            x, y, z = (
                triangles[t, c, 0] - place[0],
                triangles[t, c, 1] - place[1],
                triangles[t, c, 2] - place[2],
            )
            forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
            if forward < _NEAREST_M:
                ahead = False
                break
            scale = 1.0 / (forward * per_pixel)
            seen[c, 0] = (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * scale + 0.5 * size
            seen[c, 1] = (axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * scale + 0.5 * size
            seen[c, 2] = 1.0 / forward
        if ahead:
            _draw(seen, t, nearest, depth)
    return Picture(place, axes, per_pixel, nearest, depth)


@numba.njit(cache=True, nogil=True)
def _facing(way: np.ndarray) -> np.ndarray:
    """Right, up and forward of a direction."""
    axes = np.zeros((3, 3))
    axes[2] = way / math.sqrt((way * way).sum())
    other = np.zeros(3)
    other[np.argmin(np.abs(axes[2]))] = 1.0
    right = np.cross(axes[2], other)
    axes[0] = right / math.sqrt((right * right).sum())
    axes[1] = np.cross(axes[0], axes[2])
    return axes


@numba.njit(cache=True, nogil=True)
def _draw(seen: np.ndarray, triangle: int, nearest: np.ndarray, depth: np.ndarray) -> None:
    """Draws a triangle, its corners given in pixels and one over their distance."""
    size = len(nearest)
    x0, y0, x1, y1, x2, y2 = seen[0, 0], seen[0, 1], seen[1, 0], seen[1, 1], seen[2, 0], seen[2, 1]
    low_x, high_x = min(x0, x1, x2), max(x0, x1, x2)
    low_y, high_y = min(y0, y1, y2), max(y0, y1, y2)
    if high_x < 0.0 or high_y < 0.0 or low_x >= size or low_y >= size:
        return
    det = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if det == 0.0:
        return
    left, right = max(int(low_x), 0), min(int(high_x), size - 1)
    top, bottom = max(int(low_y), 0), min(int(high_y), size - 1)
    du_x, du_y = (y2 - y0) / det, -(x2 - x0) / det
    dv_x, dv_y = -(y1 - y0) / det, (x1 - x0) / det
    # A triangle fills its pixels to half a pixel beyond its edges: none is lost for being small.
    slack_u, slack_v = 0.5 * (abs(du_x) + abs(du_y)), 0.5 * (abs(dv_x) + abs(dv_y))
    slack = 0.5 * (abs(du_x + dv_x) + abs(du_y + dv_y))
    for j in range(top, bottom + 1):
        for i in range(left, right + 1):
            x, y = i + 0.5 - x0, j + 0.5 - y0
            u, v = du_x * x + du_y * y, dv_x * x + dv_y * y
            if u < -slack_u or v < -slack_v or u + v > 1.0 + slack:
                continue
            u, v = min(max(u, 0.0), 1.0), min(max(v, 0.0), 1.0)
            near = seen[0, 2] + u * (seen[1, 2] - seen[0, 2]) + v * (seen[2, 2] - seen[0, 2])
            if near > depth[j, i]:
                depth[j, i] = near
                nearest[j, i] = triangle


@numba.njit(cache=True, nogil=True)
def hides(drawn: Picture, bodies: Bvh, triangles: np.ndarray, point: np.ndarray) -> bool:
    """Whether a triangle stands between the place of a picture and a point.

    Args:
        drawn: The picture.
        bodies: What was drawn, for rays.
        triangles: The same as drawn [m], shape (triangle, 3, 3).
        point: The point [m], shape (3,).
    """
    size = len(drawn.nearest)
    x, y, z = point[0] - drawn.place[0], point[1] - drawn.place[1], point[2] - drawn.place[2]
    axes = drawn.axes
    forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
    if forward >= _NEAREST_M:
        scale = 1.0 / (forward * drawn.per_pixel)
        i = math.floor((axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * scale + 0.5 * size)
        j = math.floor((axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * scale + 0.5 * size)
        if 0 <= i < size and 0 <= j < size:
            if drawn.depth[j, i] * (forward - _OWN_M) <= 1.0:
                return False
            if _meets(triangles, drawn.nearest[j, i], drawn.place, x, y, z):
                return True
    at_m, hit = np.zeros(0), np.zeros(0, dtype=np.int64)
    return crossings(bodies, drawn.place, point, 2.0 * SAME_M, at_m, hit) > 0


@numba.njit(cache=True, nogil=True)
def _meets(corners: np.ndarray, i: int, place: np.ndarray, wx: float, wy: float, wz: float) -> bool:
    """Whether the way from a place meets triangle i before its end (Möller and Trumbore 1997)."""
    ax, ay, az = corners[i, 0, 0], corners[i, 0, 1], corners[i, 0, 2]
    ux, uy, uz = corners[i, 1, 0] - ax, corners[i, 1, 1] - ay, corners[i, 1, 2] - az
    vx, vy, vz = corners[i, 2, 0] - ax, corners[i, 2, 1] - ay, corners[i, 2, 2] - az
    px, py, pz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    det = ux * px + uy * py + uz * pz
    if det == 0.0:
        return False
    inverse = 1.0 / det
    sx, sy, sz = place[0] - ax, place[1] - ay, place[2] - az
    u = (sx * px + sy * py + sz * pz) * inverse
    if u < 0.0 or u > 1.0:
        return False
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    v = (wx * qx + wy * qy + wz * qz) * inverse
    if v < 0.0 or u + v > 1.0:
        return False
    at = (vx * qx + vy * qy + vz * qz) * inverse
    return 0.0 < at < 1.0
