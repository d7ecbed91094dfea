# SPDX-License-Identifier: Apache-2.0
"""Where the moving surface is: F-scores, Chamfer distance, centroid and height.

A method gives a score on the grid; its K best voxels are its prediction. K follows from the
nominal surface of what moves, never from the frame, so a method cannot be helped by knowing
how much of the body is visible.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from jaxtyping import Float, Float64, Int, Int64
from scipy.spatial import KDTree

from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.grid import VOXEL_M, Grid

#: Distances at which precision and recall are taken [m], by metric name.
THRESHOLDS_M = {"f05": 0.05, "f10": 0.10, "f20": 0.20}
#: Names of the geometry group in `metrics.json`.
GEOMETRY_KEYS = (*THRESHOLDS_M, "f10_best", "chamfer_m", "centroid_m", "height_m", "tracked")
#: A frame counts as tracked if the predicted centroid is this close [m].
TRACKED_M = 0.5
#: `f10_best` looks at every K up to this many times the nominal one.
BEST_K_FACTOR = 4
#: Height is the distance between these percentiles of z, so that one stray voxel does not set it.
HEIGHT_PERCENTILES = (2.5, 97.5)
#: K over the number of voxel faces the nominal surface covers; a surface cuts ~1.5 voxels per face.
VOXELS_PER_FACE = 1.5


def voxel_budget(instances: Sequence[dict[str, Any]]) -> int:
    """K, the number of voxels a method may predict.

    Args:
        instances: Instance table of the sequence; those with a `nominal_surface_m2` count.

    Raises:
        RfgsError: No instance has a nominal surface.

    Example:
        >>> voxel_budget([{"id": 1, "nominal_surface_m2": 1.6}])
        1500
    """
    surface = sum(float(entry.get("nominal_surface_m2") or 0.0) for entry in instances)
    if surface <= 0.0:
        raise RfgsError(
            "no instance of this sequence has a nominal_surface_m2, so there is nothing that "
            "moves to compare with; make the dataset again with a class for what moves (--people "
            "NAME, --vehicles NAME) or with its Surface set in Blender"
        )
    return round(VOXELS_PER_FACE * surface / VOXEL_M**2)


def spanned(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"]
) -> tuple[Float64[np.ndarray, "T 3 3"], Float64[np.ndarray, "T 3"], Float64[np.ndarray, "T"]]:
    """Corners of triangles [m], and normals as long as twice their areas, and these lengths."""
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces)]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, cross, np.linalg.norm(cross, axis=1)


def surface_samples(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "T 3"],
    count: int,
    rng: np.random.Generator,
) -> tuple[Float64[np.ndarray, "count 3"], Float64[np.ndarray, "count 3"]]:
    """Points [m] on a mesh, spread evenly over its area, and the normals of their faces.

    Raises:
        RfgsError: The mesh has no area.
    """
    corners, cross, area = spanned(vertices, faces)
    if not area.sum() > 0.0:
        raise RfgsError(f"expected a moving mesh with area, got {len(faces)} faces of zero area")
    face = rng.choice(len(area), size=count, p=area / area.sum())
    # Uniform over a triangle: fold the unit square along its diagonal.
    u, v = rng.random((2, count))
    fold = u + v > 1.0
    u[fold], v[fold] = 1.0 - u[fold], 1.0 - v[fold]
    edge_a, edge_b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    points = corners[face, 0] + u[:, None] * edge_a[face] + v[:, None] * edge_b[face]
    return points, cross[face] / np.maximum(area[face], 1e-30)[:, None]


def reference_points(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "T 3"],
    n: int = 20000,
    seed: int = 0,
) -> Float64[np.ndarray, "n 3"]:
    """Points on a mesh, spread evenly over its area.

    Args:
        vertices: Vertex positions [m].
        faces: Vertex indices of the triangles.
        n: Number of points.
        seed: Seed of the sampling.

    Returns:
        Points [m].

    Raises:
        RfgsError: The mesh has no area.
    """
    return surface_samples(vertices, faces, n, np.random.default_rng(seed))[0]


def best_voxels(score: Float[np.ndarray, "x y z"], count: int) -> Int64[np.ndarray, "k"]:
    """Flat indices of the `count` highest positive scores, best first, ties by index."""
    flat = np.asarray(score, dtype=np.float32).ravel()
    candidates = np.flatnonzero(flat > 0.0)
    if len(candidates) > count:
        limit = np.partition(flat[candidates], len(candidates) - count)[len(candidates) - count]
        candidates = candidates[flat[candidates] >= limit]
    order = np.argsort(-flat[candidates], kind="stable")[:count]
    return candidates[order]


@numba.njit(cache=True)
def _within(at, reach, count):
    """Range of the `count` voxel centres that lie within a reach of a place, all in voxels."""
    # A hair more, as the distance itself decides.
    low = int(np.ceil(at - reach - 1e-6))
    return max(low, 0), min(int(np.floor(at + reach + 1e-6)) + 1, count)


@numba.njit(cache=True, parallel=True)
def _first_rank(rank, origin, voxel, points, radius):
    """Lowest rank among the voxels whose centre is within `radius` of each point."""
    reach = radius / voxel
    out = np.full(points.shape[0], np.iinfo(np.int64).max, dtype=np.int64)
    for n in numba.prange(points.shape[0]):
        x, y, z = points[n]
        best = np.iinfo(np.int64).max
        first_i, end_i = _within((x - origin[0]) / voxel - 0.5, reach, rank.shape[0])
        first_j, end_j = _within((y - origin[1]) / voxel - 0.5, reach, rank.shape[1])
        first_k, end_k = _within((z - origin[2]) / voxel - 0.5, reach, rank.shape[2])
        for i in range(first_i, end_i):
            dx = origin[0] + (i + 0.5) * voxel - x
            for j in range(first_j, end_j):
                dy = origin[1] + (j + 0.5) * voxel - y
                for k in range(first_k, end_k):
                    if rank[i, j, k] >= best:
                        continue
                    dz = origin[2] + (k + 0.5) * voxel - z
                    if dx * dx + dy * dy + dz * dz <= radius * radius:
                        best = rank[i, j, k]
        out[n] = best
    return out


def _f_score(precision: np.ndarray | np.floating, recall: np.ndarray | np.floating) -> Any:
    """F = 2PR/(P+R), zero where both are."""
    return 2.0 * precision * recall / np.maximum(precision + recall, 1e-30)


def f_score_curve(
    ranked: Int64[np.ndarray, "k"],
    distance_m: Float[np.ndarray, "k"],
    grid: Grid,
    reference: Float[np.ndarray, "n 3"],
    threshold_m: float,
) -> Float64[np.ndarray, "k"]:
    """F-score at one threshold if only the first 1, 2, … of the ranked voxels are predicted.

    Args:
        ranked: Flat voxel indices, best first.
        distance_m: Distance of each of them to the nearest reference point [m].
        grid: Their grid.
        reference: Points on the true surface [m].
        threshold_m: Distance that counts as a hit [m].
    """
    precision = np.cumsum(distance_m <= threshold_m) / np.arange(1, len(ranked) + 1)
    rank = np.full(grid.size, np.iinfo(np.int64).max, dtype=np.int64)
    rank[ranked] = np.arange(len(ranked))
    first = _first_rank(
        rank.reshape(grid.shape), np.asarray(grid.origin_m), grid.voxel_m, reference, threshold_m
    )
    covered = np.bincount(first[first < len(ranked)], minlength=len(ranked))
    return _f_score(precision, np.cumsum(covered) / len(reference))


def geometry_metrics(
    score: Float[np.ndarray, "x y z"],
    grid: Grid,
    reference: Float[np.ndarray, "n 3"],
    k: int,
) -> dict[str, float | None]:
    """Geometry group of one frame.

    Precision is the share of predicted centres within a threshold of the reference, recall the
    share of reference points within it of a predicted centre, F = 2PR/(P+R).

    Args:
        score: Score per voxel; only positive scores can be predicted.
        grid: Grid of the score.
        reference: Points on the true surface [m], see `reference_points`.
        k: Number of voxels to predict, see `voxel_budget`.

    Returns:
        `f05, f10, f20` at K; `f10_best` over K up to four times that; `chamfer_m`, the mean of
        both mean nearest distances; `centroid_m`, distance between centroids; `height_m`,
        error of the vertical extent; `tracked`, 1 or 0. Distances are None if nothing is
        predicted.
    """
    if score.shape != grid.shape:
        raise ValueError(f"expected a score of shape {grid.shape}, got {score.shape}")
    ranked = best_voxels(score, BEST_K_FACTOR * k)
    if len(ranked) == 0:
        nothing: dict[str, float | None] = dict.fromkeys(GEOMETRY_KEYS)
        return nothing | {"f05": 0.0, "f10": 0.0, "f20": 0.0, "f10_best": 0.0, "tracked": 0.0}
    reference = np.ascontiguousarray(reference, dtype=np.float64)
    tree, predicted = KDTree(reference), grid.centres(ranked[:k])
    distance_m = tree.query(predicted)[0]
    # Of voxels beyond K only hits count, which are found in less time than the nearest point.
    near_m = tree.query(grid.centres(ranked[k:]), distance_upper_bound=2.0 * THRESHOLDS_M["f10"])[0]
    every_m = np.concatenate([distance_m, near_m])
    curve = f_score_curve(ranked, every_m, grid, reference, THRESHOLDS_M["f10"])
    result = _compare(predicted, distance_m, reference)
    return result | {"f10_best": float(curve.max())}


def _compare(
    predicted: Float[np.ndarray, "k 3"],
    distance_m: Float[np.ndarray, "k"],
    reference: Float[np.ndarray, "n 3"],
) -> dict[str, float | None]:
    """Metrics of predicted centres, whose distances to the reference are known [m]."""
    back_m = KDTree(predicted).query(reference)[0]
    result: dict[str, float | None] = {}
    for name, threshold_m in THRESHOLDS_M.items():
        precision, recall = np.mean(distance_m <= threshold_m), np.mean(back_m <= threshold_m)
        result[name] = float(_f_score(precision, recall))
    centroid_m = float(np.linalg.norm(predicted.mean(axis=0) - reference.mean(axis=0)))
    result["chamfer_m"] = float(0.5 * (distance_m.mean() + back_m.mean()))
    result["centroid_m"] = centroid_m
    result["height_m"] = abs(_height_m(predicted) - _height_m(reference))
    result["tracked"] = float(centroid_m <= TRACKED_M)
    return result


def _height_m(points: Float[np.ndarray, "n 3"]) -> float:
    """Vertical extent between two percentiles [m]."""
    low, high = np.percentile(points[:, 2], HEIGHT_PERCENTILES)
    return float(high - low)
