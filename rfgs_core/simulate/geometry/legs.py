# SPDX-License-Identifier: Apache-2.0
"""Ways from many points to antennas by one mirror: every face tried for every point."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Float64

from rfgs_core.simulate.geometry.bvh import triangle_at
from rfgs_core.simulate.geometry.faces import Faces, mirrored
from rfgs_core.simulate.geometry.surroundings import Surroundings
from rfgs_core.threads import in_threads


class Legs(NamedTuple):
    """Candidates: the mirror is in sight of the antenna, the rest is not tested."""

    point: np.ndarray
    """Point of each leg, int64, shape (leg,)."""
    site: np.ndarray
    """Antenna of each leg, transmitters first, int64, shape (leg,)."""
    triangle: np.ndarray
    """Triangle that mirrors it, int64, shape (leg,)."""
    place: np.ndarray
    """Where [m], shape (leg, 3)."""


def mirror_legs(around: Surroundings, points: Float64[np.ndarray, "point 3"]) -> Legs:
    """Legs between points and all antennas by one mirror, by point, antenna and face.

    Args:
        around: Faces and antennas.
        points: Points [m].
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    ends = np.concatenate([around.tx_xyz, around.rx_xyz])
    hidden = np.concatenate([around.tx_hidden, around.rx_hidden])

    def of_site(site: int) -> Legs:
        lit = np.flatnonzero(hidden[site] == 0)
        point, triangle, place = _of_end(around.faces, ends[site], lit, points)
        return Legs(point, np.full(len(point), site), triangle, place)

    parts = in_threads(of_site, range(len(ends)))
    every = Legs(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    order = np.lexsort((every.site, every.point))
    return Legs(*(column[order] for column in every))


@numba.njit(cache=True, nogil=True)
def _of_end(
    faces: Faces, end: np.ndarray, lit: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Point, triangle and place of the legs to one antenna."""
    planes, rims, seen = _as_seen(faces, end, lit)
    room = 4 * len(points) + 16
    point, triangle = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
    place = np.zeros((room, 3))
    meets = np.zeros(len(lit), dtype=np.bool_)
    found = 0
    for p in range(len(points)):
        _meets(planes, rims, seen, points[p], meets)
        for k in np.flatnonzero(meets):
            face = lit[k]
            image = mirrored(faces, face, end)
            over = (faces.normal[face] * points[p]).sum() - faces.offset[face]
            share = seen[2, k] / (seen[2, k] + over)
            at = image + share * (points[p] - image)
            hit = triangle_at(faces.bvh, faces.of_triangle, face, at)
            if hit < 0:
                continue
            if found == room:
                point = np.concatenate((point, np.zeros_like(point)))
                triangle = np.concatenate((triangle, np.zeros_like(triangle)))
                place = np.concatenate((place, np.zeros_like(place)))
                room *= 2
            point[found], triangle[found], place[found] = p, hit, at
            found += 1
    return point[:found], triangle[:found], place[:found]


@numba.njit(cache=True, nogil=True)
def _as_seen(
    faces: Faces, end: np.ndarray, lit: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lit faces as columns: planes (10), rims (4), and the antenna in each one's coordinates."""
    planes, rims, seen = np.zeros((10, len(lit))), np.zeros((4, len(lit))), np.zeros((3, len(lit)))
    for k in range(len(lit)):
        face = lit[k]
        planes[:3, k], planes[3, k] = faces.normal[face], faces.offset[face]
        planes[4:7, k], planes[7:, k] = faces.axes[face, 0], faces.axes[face, 1]
        rims[0, k], rims[1, k] = faces.low[face, 0], faces.high[face, 0]
        rims[2, k], rims[3, k] = faces.low[face, 1], faces.high[face, 1]
        seen[0, k] = (faces.axes[face, 0] * end).sum()
        seen[1, k] = (faces.axes[face, 1] * end).sum()
        seen[2, k] = (faces.normal[face] * end).sum() - faces.offset[face]
    return planes, rims, seen


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _meets(
    planes: np.ndarray, rims: np.ndarray, seen: np.ndarray, point: np.ndarray, out: np.ndarray
) -> None:
    """Fills in which faces' rectangles mirror a point towards the antenna."""
    nx, ny, nz, offset = planes[0], planes[1], planes[2], planes[3]
    ux, uy, uz, wx, wy, wz = planes[4], planes[5], planes[6], planes[7], planes[8], planes[9]
    low_u, high_u, low_w, high_w = rims[0], rims[1], rims[2], rims[3]
    seen_u, seen_w, seen_h = seen[0], seen[1], seen[2]
    x, y, z = point[0], point[1], point[2]
    # No branches: this becomes vector code.
    for k in range(len(out)):
        over = nx[k] * x + ny[k] * y + nz[k] * z - offset[k]
        share = seen_h[k] / (seen_h[k] + over)
        u = seen_u[k] + share * (ux[k] * x + uy[k] * y + uz[k] * z - seen_u[k])
        w = seen_w[k] + share * (wx[k] * x + wy[k] * y + wz[k] * z - seen_w[k])
        meets = (over * seen_h[k] > 0.0) & (u >= low_u[k]) & (u <= high_u[k])
        out[k] = meets & (w >= low_w[k]) & (w <= high_w[k])
