# SPDX-License-Identifier: Apache-2.0
"""Scattering points on everything that moves: evenly spread, bound to the mesh.

Random points of equal area are 3 dB too loud at a thousand points per square metre; Lloyd
samples with their own areas are 10 dB closer to the surface integral. They are made once in
the rest pose and follow the mesh as (face, barycentric coordinates).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

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
_SAMPLES_PER_POINT = 40
_LLOYD_STEPS = 20


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

    def at(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the points are when the mesh has moved.

        Args:
            vertices: Vertices of the whole moving mesh [m], shape (V, 3).

        Returns:
            Positions on the skin [m] and unit outward normals, each shape (point, 3).
        """
        corners = vertices.astype(np.float64)[self.weld]
        a, b, c = (corners[self.welded_faces[:, i]] for i in range(3))
        across = np.cross(b - a, c - a)
        normals = np.zeros_like(corners)
        for axis in range(3):
            for corner in range(3):
                normals[:, axis] += np.bincount(
                    self.welded_faces[:, corner], across[:, axis], len(corners)
                )
        positions = np.einsum("pc,pcx->px", self.barycentric, corners[self.faces])
        smooth = np.einsum("pc,pcx->px", self.barycentric, normals[self.weld[self.faces]])
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
) -> SurfacePoints:
    """Spreads points over the outer surface of a mesh in its rest pose.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        material: Material index of each triangle, shape (T,).
        instance: Instance id of each triangle, shape (T,).
        wavelength_m: Shortest wavelength [m].
        seed: Seed of the starting points.

    Returns:
        The points, about `density` times the area of them.
    """
    vertices = vertices.astype(np.float64)
    weld = _weld(vertices)
    welded = weld[faces]
    part = _parts(welded, len(vertices))
    keep = _outer(vertices, welded, part, instance)
    welded = _outward(vertices, welded[keep], part[keep])
    rng = np.random.default_rng(seed)
    index, barycentric, areas = _lloyd(vertices, welded, density(wavelength_m), rng)
    return SurfacePoints(
        faces=welded[index],
        barycentric=barycentric,
        areas=areas,
        material=material[keep][index],
        triangle=np.flatnonzero(keep)[index],
        welded_faces=welded,
        weld=weld,
    )


def triangle_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area of each triangle [m²], shape (T,)."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


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


def _outward(vertices: np.ndarray, faces: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Turns closed parts that are inside out; open sheets stay as they are."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    centre = np.stack([np.bincount(part, a[:, i]) for i in range(3)], axis=1)
    centre /= np.maximum(np.bincount(part), 1)[:, None]
    a, b, c = a - centre[part], b - centre[part], c - centre[part]
    volume = np.bincount(part, np.einsum("tx,tx->t", a, np.cross(b, c)) / 6.0)
    size = np.bincount(part, triangle_areas(vertices, faces)) ** 1.5
    inside_out = (volume < -1e-3 * size)[part]
    return np.where(inside_out[:, None], faces[:, ::-1], faces)


def _lloyd(
    vertices: np.ndarray, faces: np.ndarray, per_m2: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lloyd's iteration on dense samples; centres stay on samples, hence on the surface.

    Returns:
        Triangle of each point, its barycentric coordinates and the area of its cell [m²].
    """
    area = triangle_areas(vertices, faces)
    count = max(int(np.ceil(area.sum() * per_m2)), 1)
    samples = count * _SAMPLES_PER_POINT
    # Equal shares of area along the list of triangles, and within them the additive sequence of
    # the plastic number: no clumps, so that cells of equal size hold equally many samples.
    turn = np.arange(samples)
    level = (turn + rng.random()) / samples * area.sum()
    index = np.minimum(np.searchsorted(np.cumsum(area), level), len(area) - 1)
    u = (rng.random() + turn * 0.7548776662466927) % 1.0
    v = (rng.random() + turn * 0.5698402909980532) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    barycentric = np.stack([1.0 - u - v, u, v], axis=1)
    places = np.einsum("pc,pcx->px", barycentric, vertices[faces[index]])
    # Every n-th sample along a space-filling curve is an even start.
    along = np.argsort(_morton(places), kind="stable")
    chosen = along[_SAMPLES_PER_POINT // 2 :: _SAMPLES_PER_POINT]
    tree, cells = KDTree(places), Cells(places, along)
    for _ in range(_LLOYD_STEPS):
        cell = cells.around(places[chosen])
        size = np.bincount(cell, minlength=count)
        mean = np.stack([np.bincount(cell, places[:, i], count) for i in range(3)], axis=1)
        filled = size > 0
        _, nearest = tree.query(mean[filled] / size[filled, None])
        chosen = chosen.copy()
        chosen[filled] = nearest
        chosen = np.unique(chosen)
        count = len(chosen)
    cell = cells.around(places[chosen])
    cell_area = np.bincount(cell, minlength=count) * (area.sum() / samples)
    return index[chosen], barycentric[chosen], cell_area


class Cells:
    """Which centre is the nearest to each of many places, asked again and again.

    Neighbours are asked one after the other, which finds the tree in the cache, and no further
    than the farthest of the last time, which cuts the search short. The answers are the same.
    """

    def __init__(self, places: np.ndarray, along: np.ndarray) -> None:
        """Args are the places, shape (N, 3), and their order along a space-filling curve."""
        self._ordered, self._along = places[along], along
        self._reach_m = np.inf

    def around(self, centres: np.ndarray) -> np.ndarray:
        """Index of the nearest centre of each place, shape (N,)."""
        # As many threads as the kernels have: one in a tracing process.
        tree, threads = KDTree(centres), numba.get_num_threads()
        found = tree.query(self._ordered, distance_upper_bound=self._reach_m, workers=threads)
        distance_m, nearest = (np.asarray(values) for values in found)
        (beyond,) = np.nonzero(nearest == tree.n)
        if len(beyond):
            distance_m[beyond], nearest[beyond] = tree.query(self._ordered[beyond])
        self._reach_m = distance_m.max()
        cell = np.zeros_like(nearest)
        cell[self._along] = nearest
        return cell


def _morton(places: np.ndarray) -> np.ndarray:
    """Position along a Z-shaped space-filling curve of 2 mm cells, uint64, shape (N,)."""
    cells = ((places - places.min(axis=0)) / 2e-3).astype(np.uint64)
    code = np.zeros(len(places), dtype=np.uint64)
    for bit in range(20):
        for axis in range(3):
            picked = (cells[:, axis] >> np.uint64(bit)) & np.uint64(1)
            code |= picked << np.uint64(3 * bit + axis)
    return code
