# SPDX-License-Identifier: Apache-2.0
"""What an antenna lights by way of one mirror: the beam through every face, on every other."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M
from rfgs_core.simulate.geometry.faces import Faces, height, mirrored

#: Footprints narrower than this share of the face they fall on are searched in order of place.
_NARROW = 0.1


class Beams(NamedTuple):
    """Beams from one place, each by way of one face onto another, gathered by the latter."""

    start: np.ndarray
    """First beam of each face that beams fall on, and the end, shape (face + 1,)."""
    narrow_start: np.ndarray
    """Within those, the first beam with a narrow footprint, shape (face,)."""
    by: np.ndarray
    """Face that mirrors each beam, shape (beam,)."""
    seen: np.ndarray
    """The mirrored place in coordinates of the face [m]: along both axes, height, (3, beam)."""
    low: np.ndarray
    """Lower corner of the footprint along the face's axes [m], shape (2, beam)."""
    high: np.ndarray
    """Upper corner of the footprint [m], shape (2, beam)."""


@numba.njit(cache=True, nogil=True)
def beams(faces: Faces, place: np.ndarray, lit: np.ndarray) -> Beams:
    """Beams from a place by way of each of some faces.

    Args:
        faces: The faces.
        place: Where the beams come from [m], shape (3,).
        lit: Faces that mirror, ascending.
    """
    corners = _corners(faces)
    centre, radius = _spheres(corners)
    room = 4096
    onto, by = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
    rim = np.zeros((room, 4))
    found = 0
    near = np.zeros(len(corners), dtype=np.bool_)
    struck, prints = np.zeros(len(corners), dtype=np.int64), np.zeros((len(corners), 4))
    for face in lit:
        image = mirrored(faces, face, place)
        h = height(faces, face, image)
        _nearby(faces, face, image, h, centre, radius, near)
        near[face] = False
        count = _footprints(faces, face, image, h, corners, near, struck, prints)
        while found + count > room:
            onto, by = _grown(onto), _grown(by)
            rim = np.concatenate((rim, np.zeros_like(rim)))
            room *= 2
        onto[found : found + count], by[found : found + count] = struck[:count], face
        rim[found : found + count] = prints[:count]
        found += count
    return _gathered(faces, place, onto[:found], by[:found], rim[:found])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _nearby(
    faces: Faces,
    face: int,
    image: np.ndarray,
    h: float,
    centre: np.ndarray,
    radius: np.ndarray,
    near: np.ndarray,
) -> None:
    """Fills in which spheres the beam from an image through a face may meet.

    A point within R of a centre at depth z and distance a along an axis is seen, on the mirror,
    within h / (h + z - R) (R + a R / (h + z)) of where the centre is seen.
    """
    side = -1.0 if h > 0.0 else 1.0
    h = abs(h)
    n, u, w = faces.normal[face], faces.axes[face, 0], faces.axes[face, 1]
    nx, ny, nz, offset = n[0], n[1], n[2], faces.offset[face]
    ux, uy, uz, wx, wy, wz = u[0], u[1], u[2], w[0], w[1], w[2]
    iu = ux * image[0] + uy * image[1] + uz * image[2]
    iw = wx * image[0] + wy * image[1] + wz * image[2]
    middle_u, half_u = _middle(faces.low[face, 0], faces.high[face, 0])
    middle_w, half_w = _middle(faces.low[face, 1], faces.high[face, 1])
    xs, ys, zs = centre[0], centre[1], centre[2]
    # No branches and no early ends: this becomes vector code.
    for other in range(len(radius)):
        x, y, z, reach = xs[other], ys[other], zs[other], radius[other]
        depth = side * (nx * x + ny * y + nz * z - offset)
        along = ux * x + uy * y + uz * z - iu
        across = wx * x + wy * y + wz * z - iw
        scale = h / (h + depth)
        spread = reach * h / (h + depth - reach)
        off_u = spread * (1.0 + abs(along) / (h + depth))
        off_w = spread * (1.0 + abs(across) / (h + depth))
        meets = abs(iu + scale * along - middle_u) <= half_u + off_u
        meets &= abs(iw + scale * across - middle_w) <= half_w + off_w
        # A sphere that reaches through the plane of the mirror has no such bound.
        near[other] = (depth > -reach) & (meets | (depth <= reach))


@numba.njit(cache=True, nogil=True)
def _middle(low: float, high: float) -> tuple[float, float]:
    """Middle and half of a range."""
    return 0.5 * (low + high), 0.5 * (high - low)


@numba.njit(cache=True, nogil=True)
def _spheres(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres [m], shape (3, face), and radii [m] of spheres around rectangles."""
    centre, radius = np.zeros((3, len(corners))), np.zeros(len(corners))
    for f in range(len(corners)):
        for axis in range(3):
            centre[axis, f] = corners[f, :, axis].mean()
            radius[f] += (corners[f, 0, axis] - centre[axis, f]) ** 2
        radius[f] = np.sqrt(radius[f]) + SAME_M
    return centre, radius


@numba.njit(cache=True, nogil=True)
def _grown(values: np.ndarray) -> np.ndarray:
    return np.concatenate((values, np.zeros_like(values)))


@numba.njit(cache=True, nogil=True)
def _corners(faces: Faces) -> np.ndarray:
    """Corners of each face's rectangle [m], shape (face, 4, 3)."""
    out = np.zeros((len(faces.normal), 4, 3))
    for f in range(len(out)):
        for i in range(4):
            a = faces.low[f, 0] if i in (0, 3) else faces.high[f, 0]
            b = faces.low[f, 1] if i < 2 else faces.high[f, 1]
            out[f, i] = faces.offset[f] * faces.normal[f]
            out[f, i] += a * faces.axes[f, 0] + b * faces.axes[f, 1]
    return out


@numba.njit(cache=True, nogil=True)
def _footprints(
    faces: Faces,
    face: int,
    image: np.ndarray,
    h: float,
    corners: np.ndarray,
    near: np.ndarray,
    struck: np.ndarray,
    prints: np.ndarray,
) -> int:
    """Faces that the beam from an image through a face falls on, and where; errs towards more.

    Args:
        faces: The faces.
        face: The face that mirrors.
        image: The mirrored place [m].
        h: Its height over that face [m].
        corners: Corners of all rectangles [m], shape (face, 4, 3).
        near: Which faces to look at.
        struck: Filled with those that it falls on.
        prints: Filled with the rectangle on each: low and high along both axes [m].

    Returns:
        How many it falls on.
    """
    normal, offset, axes, low, high = faces[:5]
    x, y, z = image
    count = 0
    rim = np.zeros(4)
    for other in np.flatnonzero(near):
        # What the image sees of the rectangle, on the mirror, must meet the mirror's own ...
        ahead = _seen_on(normal, offset, axes, face, x, y, z, h, corners, other, -1.0, rim)
        if ahead == 0:
            continue
        misses = rim[0] > high[face, 0] or rim[1] < low[face, 0]
        if ahead == 4 and (misses or rim[2] > high[face, 1] or rim[3] < low[face, 1]):
            continue
        n = normal[other]
        over = n[0] * x + n[1] * y + n[2] * z - offset[other]
        if abs(over) < SAME_M:
            continue
        # ... and the mirror, projected onto the other plane, must meet the rectangle.
        toward = _seen_on(normal, offset, axes, other, x, y, z, over, corners, face, 1.0, rim)
        if toward == 0:
            continue
        if toward < 4:
            # Part of the beam leads away from the plane: the rest may reach anywhere on it.
            rim[0], rim[1], rim[2], rim[3] = -np.inf, np.inf, -np.inf, np.inf
        for axis in range(2):
            rim[2 * axis] = max(rim[2 * axis], low[other, axis])
            rim[2 * axis + 1] = min(rim[2 * axis + 1], high[other, axis])
        if rim[0] <= rim[1] and rim[2] <= rim[3]:
            struck[count] = other
            prints[count] = rim
            count += 1
    return count


@numba.njit(cache=True, nogil=True, inline="always")
def _seen_on(
    normal: np.ndarray,
    offset: np.ndarray,
    axes: np.ndarray,
    plane: int,
    x: float,
    y: float,
    z: float,
    h: float,
    corners: np.ndarray,
    other: int,
    side: float,
    rim: np.ndarray,
) -> int:
    """Projects a rectangle onto a plane, as seen from (x, y, z) at height h over that plane.

    With `side` −1 corners count that lie beyond the plane, with 1 those on the ray to it. Fills
    `rim` with low and high along both axes; returns how many corners count.
    """
    nx, ny, nz = normal[plane, 0], normal[plane, 1], normal[plane, 2]
    ux, uy, uz = axes[plane, 0, 0], axes[plane, 0, 1], axes[plane, 0, 2]
    wx, wy, wz = axes[plane, 1, 0], axes[plane, 1, 1], axes[plane, 1, 2]
    iu, iw = ux * x + uy * y + uz * z, wx * x + wy * y + wz * z
    count = 0
    low_u, high_u, low_w, high_w = np.inf, -np.inf, np.inf, -np.inf
    for i in range(4):
        cx, cy, cz = corners[other, i, 0], corners[other, i, 1], corners[other, i, 2]
        over = nx * cx + ny * cy + nz * cz - offset[plane]
        if side < 0.0 and (over * h > 0.0 or abs(over) < SAME_M):
            continue
        if (h - over) * h <= 0.0 or abs(h - over) < 1e-9:
            continue
        t = h / (h - over)
        a = iu + t * (ux * cx + uy * cy + uz * cz - iu)
        b = iw + t * (wx * cx + wy * cy + wz * cz - iw)
        low_u, high_u = min(low_u, a), max(high_u, a)
        low_w, high_w = min(low_w, b), max(high_w, b)
        count += 1
    rim[0], rim[1], rim[2], rim[3] = low_u, high_u, low_w, high_w
    return count


@numba.njit(cache=True, nogil=True)
def _gathered(
    faces: Faces, place: np.ndarray, onto: np.ndarray, by: np.ndarray, rim: np.ndarray
) -> Beams:
    """Beams by the face they fall on: wide ones first, narrow ones in order of place."""
    count = len(faces.normal)
    wide = np.zeros(len(onto), dtype=np.bool_)
    key = np.zeros(len(onto))
    for i in range(len(onto)):
        span = faces.high[onto[i], 0] - faces.low[onto[i], 0]
        wide[i] = rim[i, 1] - rim[i, 0] > _NARROW * span
        # One number that sorts by face, then width, then place.
        share = (rim[i, 0] - faces.low[onto[i], 0]) / span
        key[i] = 2.0 * onto[i] + (0.0 if wide[i] else 1.0) + 0.5 * min(max(share, 0.0), 1.0)
    order = np.argsort(key, kind="mergesort")
    start, narrow = np.zeros(count + 1, dtype=np.int64), np.zeros(count, dtype=np.int64)
    for i in range(len(onto)):
        start[onto[i] + 1] += 1
        if wide[i]:
            narrow[onto[i]] += 1
    for f in range(count):
        start[f + 1] += start[f]
        narrow[f] += start[f]
    onto, by, rim = onto[order], by[order], rim[order]
    seen = np.zeros((3, len(onto)))
    low, high = np.zeros((2, len(onto))), np.zeros((2, len(onto)))
    for i in range(len(onto)):
        image = mirrored(faces, by[i], place)
        seen[0, i] = (faces.axes[onto[i], 0] * image).sum()
        seen[1, i] = (faces.axes[onto[i], 1] * image).sum()
        seen[2, i] = height(faces, onto[i], image)
        low[0, i], high[0, i], low[1, i], high[1, i] = rim[i]
    return Beams(start, narrow, by, seen, low, high)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def onward(
    beams: Beams, begin: int, end: int, target: np.ndarray, rim: np.ndarray, out: np.ndarray
) -> None:
    """Fills in which beams of one face go on, mirrored by it, to a place.

    Args:
        beams: The beams.
        begin: First of them.
        end: One past the last.
        target: The place in coordinates of the face [m]: along both axes, height, shape (3,).
        rim: Where on the face the way must lead: low and high along both axes [m], shape (4,).
        out: Filled, bool, shape (end - begin,).
    """
    seen_u, seen_w, seen_h = beams.seen[0], beams.seen[1], beams.seen[2]
    low_u, low_w, high_u, high_w = beams.low[0], beams.low[1], beams.high[0], beams.high[1]
    u, w, h = target[0], target[1], target[2]
    rim_0, rim_1, rim_2, rim_3 = rim[0], rim[1], rim[2], rim[3]
    # No branches: this becomes vector code. Both ends stand on one side of the mirror.
    for k in range(end - begin):
        i = begin + k
        t = seen_h[i] / (seen_h[i] + h)
        at_u = seen_u[i] + t * (u - seen_u[i])
        at_w = seen_w[i] + t * (w - seen_w[i])
        meets = (seen_h[i] * h > 0.0) & (at_u >= low_u[i]) & (at_u <= high_u[i])
        meets &= (at_w >= low_w[i]) & (at_w <= high_w[i])
        meets &= (at_u >= rim_0) & (at_u <= rim_1) & (at_w >= rim_2) & (at_w <= rim_3)
        out[k] = meets
