# SPDX-License-Identifier: Apache-2.0
"""Even samples of a surface, patch by patch: Lloyd's iteration on dense samples.

The cells of one patch never reach into another, so that each face of a box scatters with its own
area. On a flat patch a cell's point is its very centroid: then the sum over the cells is that
over the dense samples to the first order of the phase across a cell. Elsewhere it is the sample
next to the centroid, which lies on the surface where the centroid does not.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from rfgs_core.simulate.surface.cells import Cells

_SAMPLES_PER_POINT = 40
_LLOYD_STEPS = 20
#: On flat patches, where centres move freely and settle sooner.
_FLAT_STEPS = 8
#: Patches below this share of a cell are left out, the smallest first ...
_NEGLIGIBLE_CELLS = 0.5
#: ... and together no more than this share of the surface.
_LARGEST_LOSS = 5e-4
#: A patch is flat if its triangles' vector areas add up to this share of their areas.
_FLAT = 1.0 - 1e-7
#: Points on flat patches for each one elsewhere: what a face sends aslant is thousands of times
#: weaker than its points, which random cells of the ordinary size do not cancel well enough.
_FLAT_DENSITY = 1.5
#: Most points of a strip for each one of a wide patch of the same area.
_NARROWEST = 4.0
#: Largest barycentric coordinate of a centroid in the plane of its triangle.
_FARTHEST = 10.0

#: Triangle of each point, its barycentric coordinates and the area of its cell [m²].
Sampled = tuple[np.ndarray, np.ndarray, np.ndarray]


def spread(
    vertices: np.ndarray,
    faces: np.ndarray,
    patch: np.ndarray,
    per_m2: float,
    rng: np.random.Generator,
) -> Sampled:
    """Spreads points over a surface, each patch for itself.

    Args:
        vertices: Places [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        patch: Patch of each triangle, shape (T,).
        per_m2: Points per square metre.
        rng: Draws the first samples.

    Returns:
        Triangle of each point, shape (point,), its barycentric coordinates, shape (point, 3), and
        the area of its cell [m²], shape (point,). Areas of a patch add up to its own.
    """
    order = np.argsort(patch, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(patch))[:-1])
    area = triangle_areas(vertices, faces)
    kept = _worth_a_point(np.bincount(patch, area), per_m2)
    parts = []
    for triangles in (members[index] for index in kept):
        index, barycentric, areas = _lloyd(vertices, faces[triangles], per_m2, rng)
        parts.append((triangles[index], barycentric, areas))
    triangle, barycentric, areas = (np.concatenate(column) for column in zip(*parts, strict=True))
    return triangle, barycentric, areas


def triangle_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area of each triangle [m²], shape (T,)."""
    return np.linalg.norm(_vector_areas(vertices, faces), axis=1)


def _vector_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area of each triangle along its normal [m²], shape (T, 3)."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return 0.5 * np.cross(b - a, c - a)


def _worth_a_point(area: np.ndarray, per_m2: float) -> np.ndarray:
    """Patches to sample, given the area of each [m²]; slivers are left out, see above."""
    smallest = np.argsort(area, kind="stable")
    lost = np.cumsum(area[smallest]) <= _LARGEST_LOSS * area.sum()
    left_out = smallest[lost & (area[smallest] * per_m2 < _NEGLIGIBLE_CELLS)]
    return np.setdiff1d(np.arange(len(area)), left_out)


def _lloyd(
    vertices: np.ndarray, faces: np.ndarray, per_m2: float, rng: np.random.Generator
) -> Sampled:
    """Points of one patch, arguments and result as for `spread`."""
    vector = _vector_areas(vertices, faces)
    area = np.linalg.norm(vector, axis=1)
    flat = np.linalg.norm(vector.sum(axis=0)) >= _FLAT * area.sum()
    per_m2 *= _flat_density(vertices[faces], area, per_m2) if flat else 1.0
    count = max(int(np.ceil(area.sum() * per_m2)), 1)
    index, barycentric = _dense_samples(area, count * _SAMPLES_PER_POINT, rng)
    places = np.einsum("pc,pcx->px", barycentric, vertices[faces[index]])
    # Every n-th sample along a space-filling curve is an even start.
    along = np.argsort(_morton(places), kind="stable")
    centres = places[along[_SAMPLES_PER_POINT // 2 :: _SAMPLES_PER_POINT]]
    tree, cells = KDTree(places), Cells(places, along)
    for _ in range(_FLAT_STEPS if flat else _LLOYD_STEPS):
        moved, _ = _centroids(places, cells.around(centres), centres)
        if not flat:
            moved = places[np.unique(tree.query(moved)[1])]
        if np.array_equal(moved, centres):
            break
        centres = moved
    centroids, size = _centroids(places, cells.around(centres), centres)
    nearest = tree.query(centres)[1]
    index, barycentric = index[nearest], barycentric[nearest]
    if flat:
        barycentric = _moved(vertices[faces[index]], barycentric, centroids)
    return index, barycentric, size * (area.sum() / len(places))


def _flat_density(corners: np.ndarray, area: np.ndarray, per_m2: float) -> float:
    """How many times as many points a flat patch takes as other surfaces.

    A strip narrower than a cell has longer cells instead of fewer, and the phase turns too far
    along them: it takes points as if it were a cell wide.

    Args:
        corners: Its triangles [m], shape (T, 3, 3).
        area: Their areas [m²], shape (T,).
        per_m2: Points per square metre of other surfaces.
    """
    middle = corners.mean(axis=1)
    centre = area @ middle / area.sum()
    around = np.concatenate([corners - centre, 3.0 * (middle - centre)[:, None]], axis=1)
    second = np.einsum("t,tcx,tcy->xy", area, around, around) / (12.0 * area.sum())
    width_m = np.sqrt(12.0 * max(np.linalg.eigvalsh(second)[1], 0.0))
    spacing_m = 1.0 / np.sqrt(_FLAT_DENSITY * per_m2)
    return _FLAT_DENSITY * min(max(spacing_m / max(width_m, 1e-9), 1.0), _NARROWEST)


def _dense_samples(
    area: np.ndarray, samples: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Triangle and barycentric coordinates of evenly spread samples.

    Equal shares of area along the list of triangles, and within them the additive sequence of
    the plastic number: no clumps, so that cells of equal size hold equally many samples.
    """
    turn = np.arange(samples)
    level = (turn + rng.random()) / samples * area.sum()
    index = np.minimum(np.searchsorted(np.cumsum(area), level), len(area) - 1)
    u = (rng.random() + turn * 0.7548776662466927) % 1.0
    v = (rng.random() + turn * 0.5698402909980532) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return index, np.stack([1.0 - u - v, u, v], axis=1)


def _centroids(
    places: np.ndarray, cell: np.ndarray, centres: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean place [m] of each cell's samples, its centre if it has none, and how many it has."""
    size = np.bincount(cell, minlength=len(centres))
    total = np.stack([np.bincount(cell, places[:, i], len(centres)) for i in range(3)], axis=1)
    mean = total / np.maximum(size, 1)[:, None]
    return np.where(size[:, None] > 0, mean, centres), size


def _moved(corners: np.ndarray, barycentric: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Barycentric coordinates of places [m] in the planes of triangles, shape (point, 3).

    A place may lie a little outside its triangle, where the plane goes on. One that is several
    triangles away stays where it was, since it would not follow the mesh when that bends.

    Args:
        corners: The triangles [m], shape (point, 3, 3).
        barycentric: Where the points were, shape (point, 3).
        places: Where they go [m], shape (point, 3).
    """
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, way = np.cross(u, v), places - corners[:, 0]
    twice = np.einsum("px,px->p", normal, normal)
    along_u = np.einsum("px,px->p", np.cross(way, v), normal) / twice
    along_v = np.einsum("px,px->p", np.cross(u, way), normal) / twice
    found = np.stack([1.0 - along_u - along_v, along_u, along_v], axis=1)
    return np.where(np.abs(found).max(axis=1, keepdims=True) < _FARTHEST, found, barycentric)


def _morton(places: np.ndarray) -> np.ndarray:
    """Position along a Z-shaped space-filling curve of 2 mm cells, uint64, shape (N,)."""
    cells = ((places - places.min(axis=0)) / 2e-3).astype(np.uint64)
    code = np.zeros(len(places), dtype=np.uint64)
    for bit in range(20):
        for axis in range(3):
            picked = (cells[:, axis] >> np.uint64(bit)) & np.uint64(1)
            code |= picked << np.uint64(3 * bit + axis)
    return code
