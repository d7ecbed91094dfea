# SPDX-License-Identifier: Apache-2.0
"""How far one sees from places that stay, in all directions, looked at once.

Whether a point is in sight is then a matter of looking up; only where neighbouring directions
disagree, at the rims of things, a ray is cast.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh, crossings, nearest

#: Directions from pole to pole; things narrower than half a degree may be overlooked.
ROWS = 360
#: Distances that agree this well are those of one surface [m].
_SAME_SURFACE_M = 0.02


class Panorama(NamedTuple):
    """Distances from one place."""

    place: np.ndarray
    """Where [m], shape (3,)."""
    nearest: np.ndarray
    """Distance of the nearest surface by zenith angle and azimuth, infinite where there is none
    [m], float32, shape (row, column); the first and last column stand for each other's other
    side."""
    farthest: np.ndarray
    """Farthest among neighbours, of the same shape [m]."""


@numba.njit(cache=True, nogil=True)
def panorama(bvh: Bvh, place: np.ndarray, rows: int) -> Panorama:
    """Looks around from a place.

    Args:
        bvh: What stands around.
        place: Where [m], shape (3,).
        rows: Directions from pole to pole; twice as many around.
    """
    seen = np.zeros((rows, 2 * rows), dtype=np.float32)
    way = np.zeros(3)
    for i in range(rows):
        zenith = math.pi * (i + 0.5) / rows
        for j in range(2 * rows):
            azimuth = math.pi * (j + 0.5) / rows
            way[0] = math.sin(zenith) * math.cos(azimuth)
            way[1] = math.sin(zenith) * math.sin(azimuth)
            way[2] = math.cos(zenith)
            seen[i, j] = nearest(bvh, place, way, SAME_M)
    near, far = np.zeros_like(seen), np.zeros_like(seen)
    for i in range(rows):
        for j in range(2 * rows):
            low, high = np.float32(np.inf), np.float32(0.0)
            for di in range(-1, 2):
                for dj in range(-1, 2):
                    value = seen[min(max(i + di, 0), rows - 1), (j + dj) % (2 * rows)]
                    low, high = min(low, value), max(high, value)
            near[i, j], far[i, j] = low, high
    return Panorama(place, near, far)


@numba.njit(cache=True, nogil=True)
def in_sight(around: Panorama, bvh: Bvh, points: np.ndarray, out: np.ndarray) -> None:
    """Fills in whether nothing that stands still is between a place and points.

    Args:
        around: What is seen from the place.
        bvh: What stands around.
        points: The points [m], shape (point, 3).
        out: Filled, bool, shape (point,).
    """
    for p in range(len(points)):
        out[p] = sees(around, bvh, points[p])


@numba.njit(cache=True, nogil=True)
def sees(around: Panorama, bvh: Bvh, point: np.ndarray) -> bool:
    """Whether nothing that stands still is between a place and a point."""
    rows = len(around.nearest)
    place = around.place
    x, y, z = point[0] - place[0], point[1] - place[1], point[2] - place[2]
    d = math.sqrt(x * x + y * y + z * z)
    if d < SAME_M:
        return True
    i = min(int(math.acos(min(max(z / d, -1.0), 1.0)) * (rows / math.pi)), rows - 1)
    j = int((math.atan2(y, x) % (2.0 * math.pi)) * (rows / math.pi)) % (2 * rows)
    if d < around.nearest[i, j] - _SAME_SURFACE_M:
        return True
    if d > around.farthest[i, j] + _SAME_SURFACE_M:
        return False
    at_m, triangle = np.zeros(1), np.zeros(1, dtype=np.int64)
    return crossings(bvh, place, point, 2.0 * SAME_M, at_m, triangle) == 0
