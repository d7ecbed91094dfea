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

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh
from rfgs_core.simulate.geometry.faces import Faces
from rfgs_core.simulate.geometry.rays import blocked, nearest, new_stack

#: Directions along a side of each of six pictures; things narrower than 0.4° may be overlooked.
SIZE = 256
#: Distances that agree this well are those of one surface [m].
_SAME_SURFACE_M = 0.02


class Panorama(NamedTuple):
    """Distances from one place, as six pictures: ahead and behind along x, y and z."""

    place: np.ndarray
    """Where [m], shape (3,)."""
    nearest: np.ndarray
    """Distance of the nearest surface among neighbours, infinite where there is none [m],
    float32, shape (picture, row, column)."""
    farthest: np.ndarray
    """That of the farthest [m], of the same shape."""
    face: np.ndarray
    """Face that all neighbours belong to, −1 for none, −2 where they differ, int32, of the same
    shape."""


@numba.njit(cache=True, nogil=True)
def panorama(faces: Faces, place: np.ndarray, size: int) -> Panorama:
    """Looks around from a place.

    Args:
        faces: What stands around.
        place: Where [m], shape (3,).
        size: Directions along a side of each picture.
    """
    near = np.zeros((6, size, size), dtype=np.float32)
    far = np.zeros_like(near)
    # One more direction on each side, so that neighbours are known everywhere.
    seen = np.zeros((size + 2, size + 2), dtype=np.float32)
    of = np.full((size + 2, size + 2), -1, dtype=np.int32)
    face = np.zeros((6, size, size), dtype=np.int32)
    # Arrays are made once: making them takes as long as the ray.
    way, unit, stack = np.zeros(3), np.zeros(3), new_stack()
    for side in range(6):
        axis = side // 2
        for i in range(size + 2):
            for j in range(size + 2):
                way[axis] = 1.0 - 2.0 * (side % 2)
                way[(axis + 1) % 3] = (2.0 * i - 1.0) / size - 1.0
                way[(axis + 2) % 3] = (2.0 * j - 1.0) / size - 1.0
                length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
                unit[0], unit[1], unit[2] = way[0] / length, way[1] / length, way[2] / length
                seen[i, j], hit = nearest(faces.bvh, place, unit, SAME_M, stack)
                of[i, j] = faces.of_triangle[hit] if hit >= 0 else -1
        for i in range(size):
            for j in range(size):
                some = seen[i : i + 3, j : j + 3]
                near[side, i, j], far[side, i, j] = some.min(), some.max()
                every = of[i : i + 3, j : j + 3]
                face[side, i, j] = every[0, 0] if every.min() == every.max() else -2
    return Panorama(place, near, far, face)


@numba.njit(cache=True, nogil=True, inline="always")
def sees(around: Panorama, bvh: Bvh, point: np.ndarray, stack: np.ndarray) -> bool:
    """Whether nothing that stands still is between a place and a point; see `blocked`."""
    place = around.place
    x, y, z = point[0] - place[0], point[1] - place[1], point[2] - place[2]
    d = math.sqrt(x * x + y * y + z * z)
    if d < SAME_M:
        return True
    side, i, j = _pixel(x, y, z, around.nearest.shape[1])
    if d < around.nearest[side, i, j] - _SAME_SURFACE_M:
        return True
    if d > around.farthest[side, i, j] + _SAME_SURFACE_M:
        return False
    return not blocked(bvh, place, point, 2.0 * SAME_M, stack)


@numba.njit(cache=True, nogil=True, inline="always")
def sees_face(
    around: Panorama, faces: Faces, face: int, point: np.ndarray, stack: np.ndarray
) -> bool:
    """Whether nothing that stands still is between a place and a point on a face.

    Args:
        around: What is seen from the place.
        faces: What stands around.
        face: The face.
        point: The point [m], shape (3,).
        stack: Scratch of `blocked`.
    """
    place = around.place
    x, y, z = point[0] - place[0], point[1] - place[1], point[2] - place[2]
    side, i, j = _pixel(x, y, z, around.nearest.shape[1])
    seen = around.face[side, i, j]
    if seen != -2:
        return seen == face
    return not blocked(faces.bvh, place, point, 2.0 * SAME_M, stack)


@numba.njit(cache=True, nogil=True, inline="always")
def _pixel(x: float, y: float, z: float, size: int) -> tuple[int, int, int]:
    """Picture, row and column of a direction."""
    a_x, a_y, a_z = abs(x), abs(y), abs(z)
    if a_x >= a_y and a_x >= a_z:
        side, u, v = (0 if x > 0.0 else 1), y / a_x, z / a_x
    elif a_y >= a_z:
        side, u, v = (2 if y > 0.0 else 3), z / a_y, x / a_y
    else:
        side, u, v = (4 if z > 0.0 else 5), x / a_z, y / a_z
    i = min(int(0.5 * (u + 1.0) * size), size - 1)
    j = min(int(0.5 * (v + 1.0) * size), size - 1)
    return side, i, j
