# SPDX-License-Identifier: Apache-2.0
"""Scattering points on everything that moves: evenly spread, bound to the mesh.

Random points of equal area are 3 dB too loud at a thousand points per square metre; Lloyd
samples with their own areas are 10 dB closer to the surface integral. They are made once in
the rest pose and follow the mesh as (face, barycentric coordinates).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from rfgs_core.simulate.surface.edges import UNSAID, corner_normals, smooth_patches, smooth_sides
from rfgs_core.simulate.surface.lloyd import spread, triangle_areas

#: Spacing of points as a share of the shortest wavelength; 0.4 is the coarsest that works.
SPACING_WAVELENGTHS = 0.385
#: Points per square metre up to which the spacing follows the wavelength: to 13 GHz.
MAX_DENSITY = 13_000.0
#: Points per square metre beyond that, where no number that can be afforded would do: coarser
#: than a wavelength, so levels hold at 60 GHz and waveforms do not.
COARSE_DENSITY = 4500.0
#: Points sit this far outside the skin [m], so that the skin itself can shadow them.
LIFT_M = 1e-3
#: Parts of an instance smaller than this share of its area (eyes, tongue) are left out.
_SMALLEST_PART = 0.02


@dataclass(frozen=True)
class SurfacePoints:
    """Points bound to triangles of a mesh that deforms."""

    faces: np.ndarray
    """Vertices of the triangle each point lies on, int64, shape (point, 3)."""
    barycentric: np.ndarray
    """Barycentric coordinates in that triangle, shape (point, 3)."""
    areas: np.ndarray
    """Surface each point stands for [m²], shape (point,)."""
    material: np.ndarray
    """Material index of each point, shape (point,)."""
    welded_faces: np.ndarray
    """Faces of the outer surface over welded vertices, outward, shape (T', 3)."""
    triangle: np.ndarray
    """Index of the triangle each point lies on among those given, shape (point,)."""
    weld: np.ndarray
    """First vertex at the place of each vertex, shape (V,); seams share one normal."""
    corners: np.ndarray
    """Which normal each corner of `welded_faces` has, counted from 0, shape (T', 3)."""
    point_corners: np.ndarray
    """The same at the corners of the triangle each point lies on, shape (point, 3)."""

    def at(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the points are when the mesh has moved.

        Args:
            vertices: Vertices of the whole moving mesh [m], shape (V, 3).

        Returns:
            Positions on the skin [m] and unit outward normals, each shape (point, 3).
        """
        places = vertices.astype(np.float64)[self.weld]
        a, b, c = (places[self.welded_faces[:, i]] for i in range(3))
        across = np.cross(b - a, c - a)
        count = int(self.corners.max()) + 1
        normals = np.zeros((count, 3))
        for axis in range(3):
            for corner in range(3):
                normals[:, axis] += np.bincount(self.corners[:, corner], across[:, axis], count)
        positions = np.einsum("pc,pcx->px", self.barycentric, places[self.faces])
        smooth = np.einsum("pc,pcx->px", self.barycentric, normals[self.point_corners])
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        return positions, smooth / np.maximum(length, 1e-12)

    def carried(self, values: np.ndarray) -> np.ndarray:
        """Values of all vertices, such as velocities, at the points, shape (point, 3)."""
        return np.einsum("pc,pcx->px", self.barycentric, values[self.weld][self.faces])


def density(wavelength_m: float) -> float:
    """Points per square metre for a spacing of `SPACING_WAVELENGTHS`, where that is possible."""
    needed = 1.0 / (SPACING_WAVELENGTHS * wavelength_m) ** 2
    return needed if needed <= MAX_DENSITY else COARSE_DENSITY


def surface_points(
    vertices: np.ndarray,
    faces: np.ndarray,
    material: np.ndarray,
    instance: np.ndarray,
    wavelength_m: float,
    seed: int,
    edges: np.ndarray | None = None,
) -> SurfacePoints:
    """Spreads points over the outer surface of a mesh in its rest pose.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        material: Material index of each triangle, shape (T,).
        instance: Instance id of each triangle, shape (T,).
        wavelength_m: Shortest wavelength [m].
        seed: Seed of the starting points.
        edges: What the mesh says of each triangle's sides, as `Topology.edges`, shape (T, 3);
            None if it says nothing.

    Returns:
        The points, about `density` times the area of them.
    """
    vertices = vertices.astype(np.float64)
    weld = _weld(vertices)
    welded = weld[faces]
    part = _parts(welded, len(vertices))
    keep = _outer(vertices, welded, part, instance)
    said = np.full(faces.shape, UNSAID) if edges is None else edges
    welded, said = _outward(vertices, welded[keep], said[keep], part[keep])
    smooth = smooth_sides(vertices, welded, said)
    corners = corner_normals(welded, smooth)
    patch = _cut_parts(part[keep], smooth_patches(smooth, len(welded)))
    rng = np.random.default_rng(seed)
    index, barycentric, areas = spread(vertices, welded, patch, density(wavelength_m), rng)
    return SurfacePoints(
        faces=welded[index],
        barycentric=barycentric,
        areas=areas,
        material=material[keep][index],
        triangle=np.flatnonzero(keep)[index],
        welded_faces=welded,
        weld=weld,
        corners=corners,
        point_corners=corners[index],
    )


def _weld(vertices: np.ndarray) -> np.ndarray:
    """First vertex at the same place (to 10 µm) for each vertex."""
    _, first, inverse = np.unique(
        np.round(vertices * 1e5).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    return first[inverse.ravel()]


def _parts(faces: np.ndarray, num_vertices: int) -> np.ndarray:
    """Connected part of each triangle, shape (T,)."""
    rows = np.concatenate([faces[:, 0], faces[:, 1]])
    cols = np.concatenate([faces[:, 1], faces[:, 2]])
    graph = coo_matrix((np.ones(len(rows)), (rows, cols)), shape=(num_vertices, num_vertices))
    _, label = connected_components(graph, directed=False)
    return label[faces[:, 0]]


def _outer(
    vertices: np.ndarray, faces: np.ndarray, part: np.ndarray, instance: np.ndarray
) -> np.ndarray:
    """Which triangles belong to parts large enough to matter, bool, shape (T,)."""
    area = triangle_areas(vertices, faces)
    of_part = np.bincount(part, area)
    of_instance = np.bincount(instance, area)
    return of_part[part] >= _SMALLEST_PART * of_instance[instance]


def _outward(
    vertices: np.ndarray, faces: np.ndarray, said: np.ndarray, part: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Turns closed parts that are inside out, and what is said of their sides with them.

    Open sheets stay as they are.
    """
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    centre = np.stack([np.bincount(part, a[:, i]) for i in range(3)], axis=1)
    centre /= np.maximum(np.bincount(part), 1)[:, None]
    a, b, c = a - centre[part], b - centre[part], c - centre[part]
    volume = np.bincount(part, np.einsum("tx,tx->t", a, np.cross(b, c)) / 6.0)
    size = np.bincount(part, triangle_areas(vertices, faces)) ** 1.5
    inside_out = (volume < -1e-3 * size)[part][:, None]
    # Read backwards, the first two sides change places and the third keeps its own.
    return (
        np.where(inside_out, faces[:, ::-1], faces),
        np.where(inside_out, said[:, [1, 0, 2]], said),
    )


def _cut_parts(part: np.ndarray, patch: np.ndarray) -> np.ndarray:
    """Patches of triangles, all parts without an edge being one: nothing keeps their cells apart.

    Args:
        part: Connected part of each triangle, shape (T,).
        patch: Smooth patch of each triangle, shape (T,).

    Returns:
        Patch of each triangle, counted from 0 without gaps, shape (T,).
    """
    owner = np.zeros(int(patch.max()) + 1, dtype=np.int64)
    owner[patch] = part
    whole = np.bincount(owner)[part] == 1
    return np.unique(np.where(whole, -1, patch), return_inverse=True)[1]
