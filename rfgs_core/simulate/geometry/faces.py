# SPDX-License-Identifier: Apache-2.0
"""Triangles gathered into plane faces: what a wave is mirrored by."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Float, Integer

from rfgs_core.simulate.geometry.bvh import Bvh, build_bvh

#: Most faces that are searched exhaustively, the largest ones; time grows with their square.
MAX_FACES = 10_000
#: Triangles of one mesh lie in one plane when their normals and distances [m] agree this well.
_SAME_NORMAL, _SAME_PLANE_M = 1e-3, 1e-4
#: Triangles with less area than this have no normal [m²].
_NO_AREA_M2 = 1e-12
#: Places on a face are no farther apart than this [m].
_SAMPLE_M = 0.3
#: Corners are looked at from this share of the way to the middle of the triangle.
_INSET = 0.1
#: Room for rounding at the rim of a face [m].
_RIM_M = 1e-6


class Faces(NamedTuple):
    """Plane faces, largest first, and the triangles they are made of."""

    normal: np.ndarray
    """Unit normals, shape (face, 3); either side."""
    offset: np.ndarray
    """Distance of each plane from the origin along its normal [m], shape (face,)."""
    axes: np.ndarray
    """Two unit vectors within each plane, shape (face, 2, 3)."""
    low: np.ndarray
    """Lower corner of each face's rectangle along its axes [m], shape (face, 2)."""
    high: np.ndarray
    """Upper corner [m], shape (face, 2)."""
    of_triangle: np.ndarray
    """Face of each triangle, −1 for those beyond `MAX_FACES` and those without area."""
    samples: np.ndarray
    """Places on the faces [m], shape (place, 3), face by face."""
    sample_start: np.ndarray
    """First place of each face, and the end, shape (face + 1,)."""
    bvh: Bvh
    """All triangles."""


def faces_of(
    triangles: Float[np.ndarray, "triangle 3 3"],
    mesh: Integer[np.ndarray, "triangle"],
    max_faces: int = MAX_FACES,
    sample_m: float = _SAMPLE_M,
) -> Faces:
    """Gathers triangles of the same mesh and plane.

    Args:
        triangles: Corners [m].
        mesh: Mesh of each triangle; faces do not reach from one to another.
        max_faces: Most faces to keep, the largest ones.
        sample_m: Largest distance of the places that are looked at on a face [m].
    """
    triangles = np.asarray(triangles, dtype=np.float64)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1)
    flat = area > _NO_AREA_M2
    normal = across / np.maximum(2.0 * area, 1e-300)[:, None]
    # One sign for both sides: the largest component is positive.
    largest = np.argmax(np.abs(np.round(normal, 3)), axis=1)
    normal *= np.where(normal[np.arange(len(normal)), largest] < 0.0, -1.0, 1.0)[:, None]
    offset = np.einsum("tx,tx->t", normal, triangles.mean(axis=1))
    key = np.round(
        np.concatenate([normal / _SAME_NORMAL, offset[:, None] / _SAME_PLANE_M], axis=1)
    ).astype(np.int64)
    key = np.concatenate([np.asarray(mesh)[:, None], key], axis=1)
    group = np.full(len(triangles), -1)
    if flat.any():
        group[flat] = np.unique(key[flat], axis=0, return_inverse=True)[1].ravel()
    sizes = np.bincount(group[flat], area[flat]) if flat.any() else np.zeros(0)
    largest_first = np.argsort(-sizes, kind="stable")[:max_faces]
    rank = np.full(len(sizes) + 1, -1)
    rank[largest_first] = np.arange(len(largest_first))
    of_triangle = rank[group]
    return _measured(triangles, normal, offset, area, of_triangle, len(largest_first), sample_m)


def _measured(
    triangles: np.ndarray,
    normal: np.ndarray,
    offset: np.ndarray,
    area: np.ndarray,
    of_triangle: np.ndarray,
    count: int,
    sample_m: float,
) -> Faces:
    """Planes, rectangles and places of the faces."""
    used = np.flatnonzero(of_triangle >= 0)
    used = used[np.argsort(of_triangle[used], kind="stable")]
    face = of_triangle[used]
    # The plane of a face's largest triangle is the most exact.
    order = np.lexsort((-area[used], face))
    best = used[order[np.unique(face[order], return_index=True)[1]]]
    n, o = normal[best], offset[best]
    least = np.eye(3)[np.argmin(np.abs(n), axis=1)] if count else np.zeros((0, 3))
    u = np.cross(n, least)
    u /= np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300)
    axes = np.stack([u, np.cross(n, u)], axis=1)
    within = np.einsum("tcx,tax->tca", triangles[used], axes[face])
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, face, within.min(axis=1))
    np.maximum.at(high, face, within.max(axis=1))
    places, of_place = _places(triangles[used], face, sample_m)
    start = np.searchsorted(of_place, np.arange(count + 1))
    bvh = build_bvh(triangles)
    return Faces(n, o, axes, low - _RIM_M, high + _RIM_M, of_triangle, places, start, bvh)


def _places(
    triangles: np.ndarray, face: np.ndarray, sample_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places all over triangles, those of one face together, and the face of each."""
    middle = triangles.mean(axis=1)
    corners = triangles + _INSET * (middle[:, None] - triangles)
    sides = np.linalg.norm(np.roll(triangles, 1, axis=1) - triangles, axis=2).max(axis=1)
    parts = np.clip(np.ceil(sides / sample_m), 1, 40).astype(np.int64)
    places, of_place = [middle, corners.reshape(-1, 3)], [face, np.repeat(face, 3)]
    for count in np.unique(parts[parts > 1]):
        some = parts == count
        i, j = (axis.ravel() for axis in np.mgrid[0:count, 0:count])
        inside = i + j < count
        share = np.stack([i[inside], j[inside]], axis=1) / count + 1.0 / (3.0 * count)
        weight = np.concatenate([1.0 - share.sum(axis=1, keepdims=True), share], axis=1)
        places.append(np.einsum("sc,tcx->tsx", weight, triangles[some]).reshape(-1, 3))
        of_place.append(np.repeat(face[some], len(weight)))
    every, of_every = np.concatenate(places), np.concatenate(of_place)
    order = np.argsort(of_every, kind="stable")
    return every[order], of_every[order]


@numba.njit(cache=True, nogil=True)
def height(faces: Faces, face: int, place: np.ndarray) -> float:
    """Signed distance of a place from the plane of a face [m]."""
    n = faces.normal[face]
    return n[0] * place[0] + n[1] * place[1] + n[2] * place[2] - faces.offset[face]


@numba.njit(cache=True, nogil=True)
def mirrored(faces: Faces, face: int, place: np.ndarray) -> np.ndarray:
    """Image of a place in the plane of a face [m], shape (3,)."""
    return place - 2.0 * height(faces, face, place) * faces.normal[face]


@numba.njit(cache=True, nogil=True)
def holds(faces: Faces, face: int, place: np.ndarray) -> bool:
    """Whether a place in the plane of a face lies in its rectangle."""
    for axis in range(2):
        a = faces.axes[face, axis]
        along = a[0] * place[0] + a[1] * place[1] + a[2] * place[2]
        if along < faces.low[face, axis] or along > faces.high[face, axis]:
            return False
    return True
