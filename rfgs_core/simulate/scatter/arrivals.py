# SPDX-License-Identifier: Apache-2.0
"""The field that reaches every facet from a site, by each of its ways."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M
from rfgs_core.simulate.geometry.faces import Faces
from rfgs_core.simulate.geometry.rays import blocked, crossings, new_stack
from rfgs_core.simulate.scatter.antenna import Antenna
from rfgs_core.simulate.scatter.kernel import seen_from_centres
from rfgs_core.simulate.scatter.waves import components, past, send
from rfgs_core.simulate.sight.bodies import HIDDEN, UNSURE, Picture, hides
from rfgs_core.simulate.sight.mirrors import Mirror, free_by_mirror, on_mirror
from rfgs_core.simulate.sight.panorama import Panorama, sees
from rfgs_core.simulate.surface.posed import Facets

#: θ and φ of a field, complex64, shape (facet, 2, node), and whether it reaches, bool, (facet,).
Field = tuple[np.ndarray, np.ndarray]


class Slabs(NamedTuple):
    """Slabs of all materials at equally spaced cosines of the angle of incidence."""

    of_face: np.ndarray
    """Material of each face, shape (face,)."""
    mirrored: np.ndarray
    """TE and TM factors of reflection, complex64, shape (material, cosine, 2, node)."""
    passed: np.ndarray
    """TE and TM factors of transmission, of the same shape."""


class Pictures(NamedTuple):
    """Everything that moves as seen from a site, once for each body."""

    axes: np.ndarray
    """Right, up and forward, shape (body, 3, 3)."""
    per_pixel: np.ndarray
    """Width of a pixel at a distance of 1, shape (body,)."""
    nearest: np.ndarray
    """Nearest triangle of each pixel, −1 for none, int32, shape (body, row, column)."""
    depth: np.ndarray
    """One over its distance [1/m], float32, shape (body, row, column)."""


class Ends(NamedTuple):
    """What stands at the other ends of a site's links."""

    places: np.ndarray
    """Centres of the arrays, and of their images where these matter [m], shape (end, 3)."""
    lowest_k: float
    """Lowest wavenumber [rad/m]."""
    size_m: float
    """Size of two arrays together [m]."""


@numba.njit(cache=True, nogil=True)
def straight(
    facets: Facets,
    pictures: Pictures,
    around: Panorama,
    faces: Faces,
    antenna: Antenna,
    slabs: Slabs,
    wanted: np.ndarray,
    clear: Field,
    through: Field,
    behind: bool,
) -> tuple[int, int]:
    """Fields straight from a site.

    Args:
        facets: The facets.
        pictures: What moves, as seen from the site.
        around: What stands around the site.
        faces: The same as faces.
        antenna: The site's antenna.
        slabs: What the faces are made of.
        wanted: Facets that matter, int64.
        clear: Filled where nothing is in the way.
        through: Filled behind one surface.
        behind: Whether that matters.

    Returns:
        How many facets each of them reaches.
    """
    wave = np.zeros((clear[0].shape[2], 3), dtype=np.complex64)
    at_m, hit = np.zeros(1), np.zeros(1, dtype=np.int64)
    way, stack, n_clear, n_through = np.zeros(3), new_stack(), 0, 0
    for p in wanted:
        lifted = facets.lifted[p]
        free = sees(around, faces.bvh, lifted, stack)
        if not (free or behind):
            continue
        drawn = _picture(pictures, around.place, facets.body[p])
        hidden = hides(drawn, facets.triangles, lifted)
        if hidden == UNSURE and blocked(facets.bvh, around.place, lifted, 2.0 * SAME_M, stack):
            hidden = HIDDEN
        if hidden == HIDDEN:
            continue
        for axis in range(3):
            way[axis] = facets.points[p, axis] - around.place[axis]
        send(antenna, way, wave)
        if free:
            components(wave, way, clear[0][p])
            clear[1][p] = True
            n_clear += 1
        elif crossings(faces.bvh, around.place, lifted, 2.0 * SAME_M, at_m, hit) == 1:
            face = faces.of_triangle[hit[0]]
            if face >= 0:
                past(wave, way, faces.normal[face], False, slabs.passed[slabs.of_face[face]])
                components(wave, way, through[0][p])
                through[1][p] = True
                n_through += 1
    return n_clear, n_through


@numba.njit(cache=True, nogil=True)
def free_facets(
    facets: Facets,
    balls: np.ndarray,
    ends: Ends,
    around: Panorama,
    faces: Faces,
    view: Mirror,
    scratch: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Facets that nothing that stands still hides on their way by a mirror.

    Args:
        facets: The facets.
        balls: Around groups of them, see `balls_around`.
        ends: What the other ends of the links are.
        around: What stands around the site.
        faces: The same as faces.
        view: The face that mirrors.
        scratch: Filled with what is returned, int64 and float64, shapes (facet,) and (facet, 3).

    Returns:
        Which facets, and where they are mirrored [m], shape (found, 3): the first of the scratch.
    """
    points = facets.lifted, facets.normals, balls
    lit, at = on_mirror(faces, view.face, view.image, points, 2.0 * ends.size_m, scratch)
    stack, count = new_stack(), 0
    for k in range(len(lit)):
        p = lit[k]
        if _heard_together(facets, p, view.image, ends) and free_by_mirror(
            faces, view, around, facets.lifted[p], at[k], stack
        ):
            lit[count], at[count] = p, at[k]
            count += 1
    return lit[:count], at[:count]


@numba.njit(cache=True, nogil=True)
def by_mirror(
    facets: Facets,
    lit: tuple[np.ndarray, np.ndarray],
    pictures: Pictures,
    around: Panorama,
    faces: Faces,
    view: Mirror,
    antenna: Antenna,
    slabs: Slabs,
    out: Field,
) -> int:
    """Fields from a site by way of one face.

    Args:
        facets: The facets.
        lit: Those that the mirror may light and where they are mirrored, from `free_facets`.
        pictures: What moves, as seen from the site.
        around: What stands around the site.
        faces: The same as faces.
        view: The face that mirrors.
        antenna: The site's antenna.
        slabs: What the faces are made of.
        out: Filled where nothing that moves is in the way.

    Returns:
        How many facets it reaches.
    """
    wave = np.zeros((out[0].shape[2], 3), dtype=np.complex64)
    into, stack, count = np.zeros(3), new_stack(), 0
    factors = slabs.mirrored[slabs.of_face[view.face]]
    normal = faces.normal[view.face]
    for k in range(len(lit[0])):
        p, at = lit[0][k], lit[1][k]
        if blocked(facets.bvh, at, facets.lifted[p], 2.0 * SAME_M, stack):
            continue
        hidden = False
        for other in range(len(pictures.per_pixel)):
            # What moves may also stand before the mirror.
            drawn = _picture(pictures, around.place, other)
            before = hides(drawn, facets.triangles, at)
            if before == UNSURE and blocked(facets.bvh, around.place, at, 2.0 * SAME_M, stack):
                before = HIDDEN
            hidden |= before == HIDDEN
        if hidden:
            continue
        for axis in range(3):
            into[axis] = at[axis] - around.place[axis]
        send(antenna, into, wave)
        past(wave, into, normal, True, factors)
        for axis in range(3):
            into[axis] = facets.points[p, axis] - view.image[axis]
        components(wave, into, out[0][p])
        out[1][p] = True
        count += 1
    return count


@numba.njit(cache=True, nogil=True)
def wanted_facets(facets: Facets, place: np.ndarray, ends: Ends) -> np.ndarray:
    """Facets that a place and any of its partners may see together, int64.

    Args:
        facets: The facets.
        place: Centre of an array [m], shape (3,).
        ends: The partners.
    """
    found, count = np.zeros(len(facets.points), dtype=np.int64), 0
    for p in range(len(facets.points)):
        if _heard_together(facets, p, place, ends):
            found[count] = p
            count += 1
    return found[:count]


@numba.njit(cache=True, nogil=True)
def _heard_together(facets: Facets, p: int, place: np.ndarray, ends: Ends) -> bool:
    """Whether a place and any of its partners may see facet p together."""
    points, normals, partners = facets.points, facets.normals, ends.places
    n = normals[p, 0], normals[p, 1], normals[p, 2]
    x, y, z = place[0] - points[p, 0], place[1] - points[p, 1], place[2] - points[p, 2]
    if x * n[0] + y * n[1] + z * n[2] < -ends.size_m:
        return False
    d = math.sqrt(x * x + y * y + z * z)
    to = x / d, y / d, z / d
    damping = ends.lowest_k * ends.lowest_k * facets.areas[p] / 24.0
    for q in range(len(partners)):
        x, y, z = (
            partners[q, 0] - points[p, 0],
            partners[q, 1] - points[p, 1],
            partners[q, 2] - points[p, 2],
        )
        d_other = math.sqrt(x * x + y * y + z * z)
        other = x / d_other, y / d_other, z / d_other
        if seen_from_centres(to, other, n, damping, ends.size_m / min(d, d_other)):
            return True
    return False


@numba.njit(cache=True, nogil=True, inline="always")
def _picture(pictures: Pictures, place: np.ndarray, body: int) -> Picture:
    """One of several pictures from a place."""
    nearest, depth = pictures.nearest[body], pictures.depth[body]
    return Picture(place, pictures.axes[body], pictures.per_pixel[body], nearest, depth)
