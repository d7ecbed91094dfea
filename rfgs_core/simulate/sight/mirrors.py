# SPDX-License-Identifier: Apache-2.0
"""How far one sees by way of a mirror from a place that stays, looked at once."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, crossings, nearest, triangle_at
from rfgs_core.simulate.geometry.faces import Faces, height, mirrored
from rfgs_core.simulate.sight.panorama import Panorama, sees

#: Step of the places on a mirror that are looked by way of [m], and most of them along a side.
STEP_M, MOST = 0.05, 256
#: A mirror is whole when its triangles cover this share of its rectangle.
_WHOLE = 0.9999
#: Distances that agree this well are those of one surface [m].
_SAME_SURFACE_M = 0.02


class Mirror(NamedTuple):
    """One face as a mirror for one place."""

    face: int
    """The face."""
    image: np.ndarray
    """Mirror image of the place [m], shape (3,)."""
    whole: bool
    """Whether the face covers all of its rectangle."""
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
    own = faces.of_triangle[faces.bvh.triangle] == face
    corners = faces.bvh.corners[own]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    sides = faces.high[face] - faces.low[face]
    near, far = _looked(faces, face, image, STEP_M, MOST)
    return Mirror(face, image, bool(area.sum() > _WHOLE * sides.prod()), near, far)


@numba.njit(cache=True, nogil=True)
def _looked(
    faces: Faces, face: int, image: np.ndarray, step_m: float, most: int
) -> tuple[np.ndarray, np.ndarray]:
    """Nearest and farthest distance beyond the places of a mirror."""
    sides = faces.high[face] - faces.low[face]
    n_u = min(max(int(math.ceil(sides[0] / step_m)), 1), most)  # noqa: RUF046
    n_w = min(max(int(math.ceil(sides[1] / step_m)), 1), most)  # noqa: RUF046
    seen = np.zeros((n_u, n_w), dtype=np.float32)
    for i in range(n_u):
        for j in range(n_w):
            u = faces.low[face, 0] + sides[0] * (i + 0.5) / n_u
            w = faces.low[face, 1] + sides[1] * (j + 0.5) / n_w
            place = faces.offset[face] * faces.normal[face]
            place = place + u * faces.axes[face, 0] + w * faces.axes[face, 1]
            way = place - image
            way = way / math.sqrt((way * way).sum())
            seen[i, j] = nearest(faces.bvh, place, way, 2.0 * SAME_M)
    near, far = np.zeros_like(seen), np.zeros_like(seen)
    for i in range(n_u):
        for j in range(n_w):
            some = seen[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
            near[i, j], far[i, j] = some.min(), some.max()
    return near, far


@numba.njit(cache=True, nogil=True)
def meets_ball(faces: Faces, face: int, image: np.ndarray, centre: np.ndarray, r: float) -> bool:
    """Whether any of a ball may be seen from an image through its face; errs towards yes."""
    h = -height(faces, face, image)
    over = height(faces, face, centre)
    if h < 0.0:
        h, over = -h, -over
    if over < -r:
        return False
    near = max(over - r, 0.0)
    for axis in range(2):
        a = faces.axes[face, axis]
        i = (a * image).sum()
        c = (a * centre).sum()
        low, high = np.inf, -np.inf
        for side in (-r, r):
            for depth in (near, over + r):
                at = i + (c + side - i) * h / (h + depth)
                low, high = min(low, at), max(high, at)
        if low > faces.high[face, axis] or high < faces.low[face, axis]:
            return False
    return True


@numba.njit(cache=True, nogil=True)
def mirrored_at(
    faces: Faces, view: Mirror, around: Panorama, point: np.ndarray, at: np.ndarray
) -> bool:
    """Whether a point is seen by way of a mirror, nothing that stands still between, and where.

    Args:
        faces: The faces.
        view: The mirror.
        around: What is seen from the place itself.
        point: The point [m], shape (3,).
        at: Filled with the place on the mirror [m], shape (3,).
    """
    h, over = -height(faces, view.face, view.image), height(faces, view.face, point)
    if h * over <= 0.0:
        return False
    share = h / (h + over)
    u, w = 0.0, 0.0
    for axis in range(3):
        at[axis] = view.image[axis] + share * (point[axis] - view.image[axis])
        u += faces.axes[view.face, 0, axis] * at[axis]
        w += faces.axes[view.face, 1, axis] * at[axis]
    low, high = faces.low[view.face], faces.high[view.face]
    if u < low[0] or u > high[0] or w < low[1] or w > high[1]:
        return False
    if not view.whole and triangle_at(faces.bvh, faces.of_triangle, view.face, at) < 0:
        return False
    n_u, n_w = view.nearest.shape
    i = min(int((u - low[0]) / (high[0] - low[0]) * n_u), n_u - 1)
    j = min(int((w - low[1]) / (high[1] - low[1]) * n_w), n_w - 1)
    x, y, z = point[0] - at[0], point[1] - at[1], point[2] - at[2]
    d = math.sqrt(x * x + y * y + z * z)
    if d > view.farthest[i, j] + _SAME_SURFACE_M:
        return False
    at_m, triangle = np.zeros(1), np.zeros(1, dtype=np.int64)
    rim_m = 2.0 * SAME_M
    if d > view.nearest[i, j] - _SAME_SURFACE_M:
        if crossings(faces.bvh, at, point, rim_m, at_m, triangle) > 0:
            return False
    return sees(around, faces.bvh, at)
