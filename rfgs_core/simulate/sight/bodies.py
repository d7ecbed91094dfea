# SPDX-License-Identifier: Apache-2.0
"""What bodies hide from a place: triangles drawn as seen from there, the nearest one kept.

A picture alone would be as coarse as its pixels. Here every triangle fills all pixels it touches,
so that a point is surely in sight where nothing drawn is nearer. Where something is, the nearest
triangle is met exactly, and a ray through all of them may decide what is left.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

#: What a picture tells of a point.
SEEN, HIDDEN, UNSURE = 0, 1, 2
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
    vertices: np.ndarray,
    corners: np.ndarray,
    place: np.ndarray,
    centre: np.ndarray,
    radius: float,
    size: int,
) -> Picture:
    """Draws triangles from a place, looking at a ball.

    Args:
        vertices: Vertices [m], shape (V, 3).
        corners: Vertices of each triangle, shape (triangle, 3).
        place: Where from [m], shape (3,).
        centre: Middle of the ball [m], shape (3,).
        radius: Its radius [m].
        size: Pixels along a side.
    """
    axes = _facing(centre - place)
    d = math.sqrt(((centre - place) ** 2).sum())
    reach = radius / math.sqrt(d * d - radius * radius) if d > 1.03 * radius else _WIDEST
    per_pixel = 2.0 * min(1.02 * reach, _WIDEST) / size
    seen = np.zeros((3, len(vertices)), dtype=np.float32)
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (
        (axes[0, 0], axes[0, 1], axes[0, 2]),
        (axes[1, 0], axes[1, 1], axes[1, 2]),
        (axes[2, 0], axes[2, 1], axes[2, 2]),
    )
    for v in range(len(vertices)):
        x, y, z = vertices[v, 0] - place[0], vertices[v, 1] - place[1], vertices[v, 2] - place[2]
        forward = cx * x + cy * y + cz * z
        scale = 1.0 / (max(forward, 1e-9) * per_pixel)
        seen[0, v] = (ax * x + ay * y + az * z) * scale + 0.5 * size
        seen[1, v] = (bx * x + by * y + bz * z) * scale + 0.5 * size
        seen[2, v] = 1.0 / forward if forward > _NEAREST_M else 0.0
    nearest = np.full((size, size), -1, dtype=np.int32)
    depth = np.zeros((size, size), dtype=np.float32)
    for t in range(len(corners)):
        i, j, k = corners[t, 0], corners[t, 1], corners[t, 2]
        if seen[2, i] > 0.0 and seen[2, j] > 0.0 and seen[2, k] > 0.0:
            _draw(seen, i, j, k, t, nearest, depth)
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
def _draw(
    seen: np.ndarray,
    a: int,
    b: int,
    c: int,
    triangle: int,
    nearest: np.ndarray,
    depth: np.ndarray,
) -> None:
    """Draws the triangle of vertices a, b and c, given in pixels and one over their distance."""
    size = len(nearest)
    x0, y0, x1, y1, x2, y2 = seen[0, a], seen[1, a], seen[0, b], seen[1, b], seen[0, c], seen[1, c]
    z0, z1, z2 = seen[2, a], seen[2, b], seen[2, c]
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
            near = z0 + u * (z1 - z0) + v * (z2 - z0)
            if near > depth[j, i]:
                depth[j, i] = near
                nearest[j, i] = triangle


@numba.njit(cache=True, nogil=True, inline="always")
def hides(drawn: Picture, triangles: np.ndarray, point: np.ndarray) -> int:
    """Whether a triangle stands between the place of a picture and a point.

    Args:
        drawn: The picture.
        triangles: What was drawn [m], shape (triangle, 3, 3).
        point: The point [m], shape (3,).

    Returns:
        `SEEN`, `HIDDEN`, or `UNSURE` where something nearer is drawn, which only a ray can tell
        from what stands beside.
    """
    size, axes = len(drawn.nearest), drawn.axes
    x, y, z = point[0] - drawn.place[0], point[1] - drawn.place[1], point[2] - drawn.place[2]
    forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
    if forward < _NEAREST_M:
        return UNSURE
    scale = 1.0 / (forward * drawn.per_pixel)
    i = math.floor((axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * scale + 0.5 * size)
    j = math.floor((axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * scale + 0.5 * size)
    if not (0 <= i < size and 0 <= j < size):
        # Beside the body that the picture is of, unless that is too near to be drawn as a whole.
        return SEEN if drawn.per_pixel * size < 2.0 * _WIDEST else UNSURE
    if drawn.depth[j, i] * (forward - _OWN_M) <= 1.0:
        return SEEN
    return HIDDEN if _meets(triangles, int(drawn.nearest[j, i]), drawn.place, x, y, z) else UNSURE


@numba.njit(cache=True, nogil=True, inline="always")
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
