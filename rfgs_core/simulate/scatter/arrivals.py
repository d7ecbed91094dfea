# SPDX-License-Identifier: Apache-2.0
"""The field that reaches every facet from a site, by each of its ways."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh, crossings
from rfgs_core.simulate.geometry.faces import Faces
from rfgs_core.simulate.scatter.antenna import Antenna, sent_towards
from rfgs_core.simulate.scatter.kernel import seen_from_centres
from rfgs_core.simulate.sight.bodies import Picture, hides
from rfgs_core.simulate.sight.mirrors import Mirror, mirrored_at
from rfgs_core.simulate.sight.panorama import Panorama, sees


class Facets(NamedTuple):
    """Facets of one frame, and what hides them."""

    points: np.ndarray
    """Positions on the skin [m], shape (facet, 3)."""
    lifted: np.ndarray
    """Positions just outside the skin, to look from [m], shape (facet, 3)."""
    normals: np.ndarray
    """Unit outward normals, shape (facet, 3)."""
    areas: np.ndarray
    """Areas [m²], shape (facet,)."""
    material: np.ndarray
    """Material of each, int64, shape (facet,)."""
    body: np.ndarray
    """Body of each, ascending, int64, shape (facet,)."""
    triangles: np.ndarray
    """Triangles of everything that moves [m], shape (triangle, 3, 3)."""
    bvh: Bvh
    """The same for rays."""


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


@numba.njit(cache=True, nogil=True)
def straight(
    facets: Facets,
    pictures: Pictures,
    around: Panorama,
    faces: Faces,
    antenna: Antenna,
    slabs: Slabs,
    wanted: np.ndarray,
    clear: np.ndarray,
    through: np.ndarray,
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
        clear: Filled with θ and φ of the field where nothing is in the way, complex64, shape
            (facet, 2, node).
        through: Filled with those behind one surface; empty if they do not matter.

    Returns:
        How many facets each of them reaches.
    """
    wave = np.zeros((clear.shape[2], 3), dtype=np.complex64)
    at_m, hit = np.zeros(1), np.zeros(1, dtype=np.int64)
    n_clear, n_through = 0, 0
    for p in wanted:
        lifted = facets.lifted[p]
        free = sees(around, faces.bvh, lifted)
        if not (free or len(through)):
            continue
        drawn = _picture(pictures, around.place, facets.body[p])
        if hides(drawn, facets.bvh, facets.triangles, lifted):
            continue
        way = facets.points[p] - around.place
        _send(antenna, way, wave)
        if free:
            _components(wave, way, clear[p])
            n_clear += 1
        elif crossings(faces.bvh, around.place, lifted, 2.0 * SAME_M, at_m, hit) == 1:
            face = faces.of_triangle[hit[0]]
            if face >= 0:
                past(wave, way, faces.normal[face], False, slabs.passed[slabs.of_face[face]])
                _components(wave, way, through[p])
                n_through += 1
    return n_clear, n_through


@numba.njit(cache=True, nogil=True)
def by_mirror(
    facets: Facets,
    wanted: np.ndarray,
    from_image: Picture,
    pictures: Pictures,
    around: Panorama,
    faces: Faces,
    view: Mirror,
    antenna: Antenna,
    slabs: Slabs,
    out: np.ndarray,
) -> int:
    """Fields from a site by way of one face, on the facets of one body.

    Args:
        facets: The facets.
        wanted: Facets of the body that matter, int64.
        from_image: Everything that moves as seen from the image of the site towards the body.
        pictures: The same as seen from the site.
        around: What stands around the site.
        faces: The same as faces.
        view: The face.
        antenna: The site's antenna.
        slabs: What the faces are made of.
        out: Filled with θ and φ of the field where nothing is in the way, complex64, shape
            (facet, 2, node).

    Returns:
        How many facets it reaches.
    """
    wave = np.zeros((out.shape[2], 3), dtype=np.complex64)
    at, count = np.zeros(3), 0
    factors = slabs.mirrored[slabs.of_face[view.face]]
    for p in wanted:
        if not mirrored_at(faces, view, around, facets.lifted[p], at):
            continue
        hidden = hides(from_image, facets.bvh, facets.triangles, facets.lifted[p])
        for other in range(len(pictures.per_pixel)):
            # What moves may also stand before the mirror.
            drawn = _picture(pictures, around.place, other)
            hidden = hidden or hides(drawn, facets.bvh, facets.triangles, at)
        if hidden:
            continue
        into = at - around.place
        _send(antenna, into, wave)
        past(wave, into, faces.normal[view.face], True, factors)
        _components(wave, facets.points[p] - view.image, out[p])
        count += 1
    return count


@numba.njit(cache=True, nogil=True)
def wanted_facets(
    facets: Facets,
    body: tuple[int, int],
    place: np.ndarray,
    partners: np.ndarray,
    lowest_k: float,
    size_m: float,
) -> np.ndarray:
    """Facets of a body that a place and any of its partners may see together, int64.

    Args:
        facets: The facets.
        body: First facet of the body and one past its last.
        place: Centre of an array, or of its image [m], shape (3,).
        partners: Centres of the arrays at the other end, and of their images [m], (partner, 3).
        lowest_k: Lowest wavenumber [rad/m].
        size_m: Size of both arrays together [m].
    """
    found = np.zeros(body[1] - body[0], dtype=np.int64)
    count = 0
    for p in range(body[0], body[1]):
        n = facets.normals[p]
        to = place - facets.points[p]
        d = math.sqrt((to * to).sum())
        if (to * n).sum() < -size_m:
            continue
        for partner in partners:
            other = partner - facets.points[p]
            d_other = math.sqrt((other * other).sum())
            damping, spread = lowest_k**2 * facets.areas[p] / 24.0, size_m / min(d, d_other)
            if seen_from_centres(to / d, other / d_other, n, damping, spread):
                found[count] = p
                count += 1
                break
    return found[:count]


@numba.njit(cache=True, nogil=True)
def _send(antenna: Antenna, way: np.ndarray, wave: np.ndarray) -> None:
    """Fills in what an antenna sends in a direction, the same at each node."""
    x, y, z = sent_towards(antenna, way)
    for m in range(len(wave)):
        wave[m, 0], wave[m, 1], wave[m, 2] = x, y, z


@numba.njit(cache=True, nogil=True)
def _picture(pictures: Pictures, place: np.ndarray, body: int) -> Picture:
    """One of several pictures from a place."""
    nearest, depth = pictures.nearest[body], pictures.depth[body]
    return Picture(place, pictures.axes[body], pictures.per_pixel[body], nearest, depth)


@numba.njit(cache=True, nogil=True)
def past(
    wave: np.ndarray, into: np.ndarray, normal: np.ndarray, mirrors: bool, factors: np.ndarray
) -> None:
    """Sends a wave past a slab, in place; the twin of `rfgs_core.simulate.paths.fields.past_slab`.

    Args:
        wave: Field at each node, complex64, shape (node, 3).
        into: Its direction, of any length, shape (3,).
        normal: Unit normal of the slab, either side.
        mirrors: Whether the wave is mirrored, else it passes.
        factors: TE and TM factors over cosines, shape (cosine, 2, node).
    """
    k = into / math.sqrt((into * into).sum())
    along = (k * normal).sum()
    across = np.cross(k, normal)
    size = math.sqrt((across * across).sum())
    if size < 1e-9:
        other = np.zeros(3)
        other[np.argmin(np.abs(normal))] = 1.0
        across = np.cross(normal, other)
        size = math.sqrt((across * across).sum())
    across = across / size
    out = k - 2.0 * along * normal if mirrors else k
    before, after = np.cross(across, k), np.cross(across, out)
    place = min(abs(along), 1.0) * (len(factors) - 1)
    low = min(int(place), len(factors) - 2)
    share = np.float32(place - low)
    for m in range(len(wave)):
        te = factors[low, 0, m] + share * (factors[low + 1, 0, m] - factors[low, 0, m])
        tm = factors[low, 1, m] + share * (factors[low + 1, 1, m] - factors[low, 1, m])
        te *= wave[m, 0] * across[0] + wave[m, 1] * across[1] + wave[m, 2] * across[2]
        tm *= wave[m, 0] * before[0] + wave[m, 1] * before[1] + wave[m, 2] * before[2]
        for axis in range(3):
            wave[m, axis] = te * across[axis] + tm * after[axis]


@numba.njit(cache=True, nogil=True)
def _components(wave: np.ndarray, way: np.ndarray, out: np.ndarray) -> None:
    """Fills in θ and φ of a wave at each node, complex64, shape (2, node)."""
    flat = math.hypot(way[0], way[1])
    d = math.hypot(flat, way[2])
    cos_phi, sin_phi = (way[0] / flat, way[1] / flat) if flat > 1e-7 * d else (1.0, 0.0)
    cos_theta, sin_theta = way[2] / d, flat / d
    for m in range(len(wave)):
        along = wave[m, 0] * cos_phi + wave[m, 1] * sin_phi
        out[0, m] = along * cos_theta - wave[m, 2] * sin_theta
        out[1, m] = wave[m, 1] * cos_phi - wave[m, 0] * sin_phi
