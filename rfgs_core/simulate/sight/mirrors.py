# SPDX-License-Identifier: Apache-2.0
"""How far one sees by way of a mirror from a place that stays, looked at once."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, triangle_at
from rfgs_core.simulate.geometry.faces import Faces, height, mirrored
from rfgs_core.simulate.geometry.rays import blocked, nearest, new_stack
from rfgs_core.simulate.sight.panorama import Panorama, sees_face

#: Step of the places on a mirror that are looked by way of [m], and most of them along a side.
STEP_M, MOST = 0.05, 256
#: Points that are looked at together.
GROUP = 32
#: Distances that agree this well are those of one surface [m].
_SAME_SURFACE_M = 0.02


class Mirror(NamedTuple):
    """One face as a mirror for one place."""

    face: int
    """The face."""
    image: np.ndarray
    """Mirror image of the place [m], shape (3,)."""
    covered: np.ndarray
    """Whether the face covers the neighbourhood of each place of its rectangle: 1 all, 0 nothing,
    −1 some of it, int8, shape (u, w)."""
    nearest: np.ndarray
    """How far one sees beyond each place on the mirror [m], float32, shape (u, w)."""
    farthest: np.ndarray
    """Farthest among neighbours [m], of the same shape."""


def mirror(faces: Faces, face: int, place: np.ndarray) -> Mirror:
    """Looks from a place by way of a face.

    Args:
        faces: The faces.
        face: Which of them.
        place: Where from [m], shape (3,).
    """
    image = mirrored(faces, face, place)
    return Mirror(face, image, *_looked(faces, face, image, STEP_M, MOST))


@numba.njit(cache=True, nogil=True)
def _looked(
    faces: Faces, face: int, image: np.ndarray, step_m: float, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is covered, and nearest and farthest distance beyond, of the places of a mirror."""
    sides = faces.high[face] - faces.low[face]
    n_u = min(max(int(math.ceil(sides[0] / step_m)), 1), most)  # noqa: RUF046
    n_w = min(max(int(math.ceil(sides[1] / step_m)), 1), most)  # noqa: RUF046
    seen = np.zeros((n_u, n_w), dtype=np.float32)
    holds = np.zeros((n_u, n_w), dtype=np.int8)
    stack = new_stack()
    for i in range(n_u):
        for j in range(n_w):
            u = faces.low[face, 0] + sides[0] * (i + 0.5) / n_u
            w = faces.low[face, 1] + sides[1] * (j + 0.5) / n_w
            place = faces.offset[face] * faces.normal[face]
            place = place + u * faces.axes[face, 0] + w * faces.axes[face, 1]
            way = place - image
            way = way / math.sqrt((way * way).sum())
            seen[i, j] = nearest(faces.bvh, place, way, 2.0 * SAME_M, stack)[0]
            holds[i, j] = triangle_at(faces.bvh, faces.of_triangle, face, place) >= 0
    near, far, covered = np.zeros_like(seen), np.zeros_like(seen), np.zeros_like(holds)
    for i in range(n_u):
        for j in range(n_w):
            some = seen[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
            near[i, j], far[i, j] = some.min(), some.max()
            every = holds[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
            covered[i, j] = every[0, 0] if every.min() == every.max() else -1
    return covered, near, far


@numba.njit(cache=True, nogil=True)
def meeting_ball(
    faces: Faces, face: np.ndarray, image: np.ndarray, centre: np.ndarray, r: float
) -> np.ndarray:
    """Which images may see any of a ball through their faces, int64; errs towards more.

    Args:
        faces: The faces.
        face: Face of each image, shape (image,).
        image: The images [m], shape (image, 3).
        centre: Centre of the ball [m], shape (3,).
        r: Its radius [m].
    """
    found, count = np.zeros(len(face), dtype=np.int64), 0
    for k in range(len(face)):
        if _meets(faces, face[k], image[k], centre, r):
            found[count] = k
            count += 1
    return found[:count]


@numba.njit(cache=True, nogil=True)
def _meets(faces: Faces, f: int, image: np.ndarray, centre: np.ndarray, r: float) -> bool:
    """Whether an image may see any of a ball through a face; errs towards more."""
    h, over = -height(faces, f, image), height(faces, f, centre)
    if h < 0.0:
        h, over = -h, -over
    if over <= -r:
        return False
    near = max(over - r, 0.0)
    for axis in range(2):
        i, c = 0.0, 0.0
        for x in range(3):
            i += faces.axes[f, axis, x] * image[x]
            c += faces.axes[f, axis, x] * centre[x]
        low, high = np.inf, -np.inf
        for side in (-r, r):
            for depth in (near, over + r):
                at = i + (c + side - i) * h / (h + depth)
                low, high = min(low, at), max(high, at)
        if low > faces.high[f, axis] or high < faces.low[f, axis]:
            return False
    return True


@numba.njit(cache=True, nogil=True)
def balls_around(points: np.ndarray) -> np.ndarray:
    """Balls around every `GROUP` points in turn [m], rows x, y, z and radius, (group, 4)."""
    balls = np.zeros(((len(points) + GROUP - 1) // GROUP, 4))
    for group in range(len(balls)):
        some, far = points[group * GROUP : (group + 1) * GROUP], 0.0
        for axis in range(3):
            balls[group, axis] = 0.5 * (some[:, axis].min() + some[:, axis].max())
        for p in range(len(some)):
            far = max(far, ((some[p] - balls[group, :3]) ** 2).sum())
        balls[group, 3] = math.sqrt(far) + 1e-6
    return balls


@numba.njit(cache=True, nogil=True)
def on_mirror(
    faces: Faces,
    face: int,
    image: np.ndarray,
    points: tuple[np.ndarray, np.ndarray, np.ndarray],
    slack_m: float,
    scratch: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Which points may be seen by way of a mirror, by its rectangle alone, and where.

    Args:
        faces: The faces.
        face: The mirror.
        image: Image of the place in it [m], shape (3,).
        points: The points [m], the normals of their surface, each of shape (point, 3), and balls
            around groups of them, from `balls_around`.
        slack_m: How far behind a point's surface the image may lie [m].
        scratch: Filled, see below; of the length of the points.

    Returns:
        Those that face the image and meet the rectangle, int64, and the places where [m], shape
        (lit, 3): the first of the scratch.
    """
    n, u, w = faces.normal[face], faces.axes[face, 0], faces.axes[face, 1]
    nx, ny, nz, offset = n[0], n[1], n[2], faces.offset[face]
    ux, uy, uz, wx, wy, wz = u[0], u[1], u[2], w[0], w[1], w[2]
    low_u, low_w = faces.low[face, 0], faces.low[face, 1]
    high_u, high_w = faces.high[face, 0], faces.high[face, 1]
    ix, iy, iz = image[0], image[1], image[2]
    h = offset - (nx * ix + ny * iy + nz * iz)
    (where, normals, balls), (lit, at) = points, scratch
    count = 0
    for group in range(len(balls)):
        if not _meets(faces, face, image, balls[group, :3], balls[group, 3]):
            continue
        for p in range(group * GROUP, min((group + 1) * GROUP, len(where))):
            x, y, z = where[p, 0], where[p, 1], where[p, 2]
            facing = (ix - x) * normals[p, 0] + (iy - y) * normals[p, 1] + (iz - z) * normals[p, 2]
            over = nx * x + ny * y + nz * z - offset
            if facing < -slack_m or h * over <= 0.0:
                continue
            share = h / (h + over)
            x, y, z = ix + share * (x - ix), iy + share * (y - iy), iz + share * (z - iz)
            a, b = ux * x + uy * y + uz * z, wx * x + wy * y + wz * z
            if a < low_u or a > high_u or b < low_w or b > high_w:
                continue
            lit[count], at[count, 0], at[count, 1], at[count, 2] = p, x, y, z
            count += 1
    return lit[:count], at[:count]


@numba.njit(cache=True, nogil=True, inline="always")
def free_by_mirror(
    faces: Faces,
    view: Mirror,
    around: Panorama,
    point: np.ndarray,
    at: np.ndarray,
    stack: np.ndarray,
) -> bool:
    """Whether nothing that stands still is on the way to a point by a mirror.

    Args:
        faces: The faces.
        view: The mirror.
        around: What is seen from the place itself.
        point: The point [m], shape (3,).
        at: Where the way meets the mirror [m], shape (3,).
        stack: Scratch of `blocked`.
    """
    n_u, n_w = view.nearest.shape
    low, high, axes = faces.low[view.face], faces.high[view.face], faces.axes[view.face]
    u = axes[0, 0] * at[0] + axes[0, 1] * at[1] + axes[0, 2] * at[2]
    w = axes[1, 0] * at[0] + axes[1, 1] * at[1] + axes[1, 2] * at[2]
    i = min(int((u - low[0]) / (high[0] - low[0]) * n_u), n_u - 1)
    j = min(int((w - low[1]) / (high[1] - low[1]) * n_w), n_w - 1)
    x, y, z = point[0] - at[0], point[1] - at[1], point[2] - at[2]
    d = math.sqrt(x * x + y * y + z * z)
    if view.covered[i, j] == 0 or d > view.farthest[i, j] + _SAME_SURFACE_M:
        return False
    if not sees_face(around, faces, view.face, at, stack):
        return False
    if view.covered[i, j] < 0 and triangle_at(faces.bvh, faces.of_triangle, view.face, at) < 0:
        return False
    if d < view.nearest[i, j] - _SAME_SURFACE_M:
        return True
    return not blocked(faces.bvh, at, point, 2.0 * SAME_M, stack)
