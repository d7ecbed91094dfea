# SPDX-License-Identifier: Apache-2.0
"""Which Gaussians touch which 16 × 16 tile of a picture, nearest first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import torch
from jaxtyping import Float64, Int32, Int64

from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.splat import ALPHA_MIN, DILATION_PX2, NEAR_M, SLOPE_MARGIN, TILE_PX


@dataclass(frozen=True)
class TiledSplats:
    """The S visible Gaussians of one camera, sorted by depth, and the tiles they touch."""

    width: int
    """Columns of the picture [px]."""
    height: int
    """Rows of the picture [px]."""
    rows: Int64[np.ndarray, "S"]
    """Row of each splat in the set of Gaussians it came from."""
    splats: Float64[np.ndarray, "S 7"]
    """Centre (column, row) [px], inverse covariance (xx, xy, yy) [1/px²], opacity, and the
    largest exponent that still reaches `ALPHA_MIN`."""
    depths: Float64[np.ndarray, "S"]
    """Planar depths [m], ascending."""
    starts: Int64[np.ndarray, "T1"]
    """First entry of each tile, and one past the last; tiles run along rows."""
    entries: Int32[np.ndarray, "E"]
    """Splats of all tiles, nearest first within a tile."""


def tile_splats(gaussians: Gaussians, camera: Camera) -> TiledSplats:
    """Projects Gaussians (formulas in `splat.py`), culls, sorts by depth and fills the tiles.

    Equal depths keep the order of the set, so that the picture does not depend on threads.
    """
    count = len(gaussians)
    splats, depths = np.zeros((count, 7)), np.zeros(count)
    bounds = np.zeros((count, 4), np.int64)
    seen = np.zeros(count, np.bool_)
    eye = np.array([camera.fl_x, camera.fl_y, camera.cx, camera.cy])
    _project(
        _array(gaussians.means),
        _array(gaussians.quats),
        _array(gaussians.log_scales),
        _array(gaussians.logit_opacities),
        np.ascontiguousarray(camera.view_from_world),
        eye,
        (camera.width, camera.height),
        splats,
        depths,
        bounds,
        seen,
    )
    rows = np.flatnonzero(seen)
    rows = rows[np.argsort(depths[rows], kind="stable")]
    tile_bounds = bounds[rows] // TILE_PX
    tile_bounds[:, 1::2] = -(-bounds[rows][:, 1::2] // TILE_PX)
    columns = -(-camera.width // TILE_PX)
    starts, entries = _fill_tiles(tile_bounds, columns, columns * -(-camera.height // TILE_PX))
    return TiledSplats(
        width=camera.width,
        height=camera.height,
        rows=rows,
        splats=splats[rows],
        depths=depths[rows],
        starts=starts,
        entries=entries,
    )


def _array(values: torch.Tensor) -> np.ndarray:
    return np.ascontiguousarray(values.detach().cpu().numpy())


@numba.njit(cache=True, inline="always")
def _along(view: np.ndarray, row: int, vector: tuple[float, float, float]) -> float:
    """One view axis of a vector of the world."""
    return view[row, 0] * vector[0] + view[row, 1] * vector[1] + view[row, 2] * vector[2]


@numba.njit(cache=True, inline="always")
def _axes(w: float, x: float, y: float, z: float) -> tuple[Any, Any, Any]:
    """Columns of the rotation of a quaternion of any length."""
    k = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1 - k * (y * y + z * z), k * (x * y + w * z), k * (x * z - w * y)),
        (k * (x * y - w * z), 1 - k * (x * x + z * z), k * (y * z + w * x)),
        (k * (x * z + w * y), k * (y * z - w * x), 1 - k * (x * x + y * y)),
    )


@numba.njit(cache=True, inline="always")
def _covariance(
    axes: tuple[Any, Any, Any],
    sizes_m: tuple[float, float, float],
    place: tuple[float, float, float],
    view: np.ndarray,
    eye: np.ndarray,
    size: tuple[int, int],
) -> tuple[float, float, float]:
    """Dilated covariance in the picture, (xx, xy, yy) [px²].

    Each principal axis is a small arrow; its picture is J applied to it.
    """
    limit_x = SLOPE_MARGIN * 0.5 * size[0] / eye[0]
    limit_y = SLOPE_MARGIN * 0.5 * size[1] / eye[1]
    slope_x = min(max(place[0] / place[2], -limit_x), limit_x)
    slope_y = min(max(place[1] / place[2], -limit_y), limit_y)
    xx, xy, yy = DILATION_PX2, 0.0, DILATION_PX2
    for axis, size_m in zip(axes, sizes_m):  # noqa: B905  numba knows no `strict`
        forward = _along(view, 2, axis)
        across = eye[0] / place[2] * size_m * (_along(view, 0, axis) - slope_x * forward)
        down = eye[1] / place[2] * size_m * (_along(view, 1, axis) - slope_y * forward)
        xx, xy, yy = xx + across * across, xy + across * down, yy + down * down
    return xx, xy, yy


@numba.njit(cache=True, inline="always")
def _pixels(middle: float, variance: float, reach: float, size: int) -> tuple[int, int]:
    """First and one-past-last pixel whose centre a splat may reach."""
    half = np.sqrt(2.0 * reach * variance)
    first = min(max(np.floor(middle - half - 0.5), 0.0), float(size))
    last = min(max(np.ceil(middle + half + 0.5), 0.0), float(size))
    return int(first), int(last)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _project(
    means: np.ndarray,  # [M, 3]
    quats: np.ndarray,  # [M, 4]
    log_scales: np.ndarray,  # [M, 3]
    logits: np.ndarray,  # [M]
    view: np.ndarray,  # [4, 4], view axes from the world
    eye: np.ndarray,  # focal lengths and optical axis [px]
    size: tuple[int, int],  # columns and rows of the picture
    splats: np.ndarray,  # [M, 7], written where seen
    depths: np.ndarray,  # [M]
    bounds: np.ndarray,  # [M, 4], first and one-past-last column and row that may be reached
    seen: np.ndarray,  # [M]
) -> None:
    for row in numba.prange(len(means)):
        mean = float(means[row, 0]), float(means[row, 1]), float(means[row, 2])
        depth = _along(view, 2, mean) + view[2, 3]
        opacity = 1.0 / (1.0 + np.exp(-float(logits[row])))
        if not (depth > NEAR_M and opacity >= ALPHA_MIN):
            continue
        place = _along(view, 0, mean) + view[0, 3], _along(view, 1, mean) + view[1, 3], depth
        w, x = float(quats[row, 0]), float(quats[row, 1])
        axes = _axes(w, x, float(quats[row, 2]), float(quats[row, 3]))
        sizes_m = (
            np.exp(float(log_scales[row, 0])),
            np.exp(float(log_scales[row, 1])),
            np.exp(float(log_scales[row, 2])),
        )
        xx, xy, yy = _covariance(axes, sizes_m, place, view, eye, size)
        reach = np.log(opacity / ALPHA_MIN)
        column, line = eye[0] * place[0] / depth + eye[2], eye[1] * place[1] / depth + eye[3]
        determinant = xx * yy - xy * xy
        # Numbers that are none hold in no comparison; they would name tiles that are not there.
        if not (determinant > 0.0 and np.isfinite(determinant) and np.isfinite(column + line)):
            continue
        bounds[row, 0], bounds[row, 1] = _pixels(column, xx, reach, size[0])
        bounds[row, 2], bounds[row, 3] = _pixels(line, yy, reach, size[1])
        seen[row] = bounds[row, 0] < bounds[row, 1] and bounds[row, 2] < bounds[row, 3]
        splats[row, 0], splats[row, 1], splats[row, 2] = column, line, yy / determinant
        splats[row, 3], splats[row, 4] = -xy / determinant, xx / determinant
        splats[row, 5], splats[row, 6], depths[row] = opacity, reach, depth


@numba.njit(cache=True)
def _fill_tiles(tile_bounds: np.ndarray, columns: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Starts [count + 1] and entries [E] of the tiles; splats come in depth order and keep it."""
    starts = np.zeros(count + 1, np.int64)
    for splat in range(tile_bounds.shape[0]):
        left, right, top, bottom = tile_bounds[splat]
        for row in range(top, bottom):
            for column in range(left, right):
                starts[row * columns + column + 1] += 1
    starts = np.cumsum(starts)
    entries = np.zeros(starts[count], np.int32)
    cursor = starts[:count].copy()
    for splat in range(tile_bounds.shape[0]):
        left, right, top, bottom = tile_bounds[splat]
        for row in range(top, bottom):
            for column in range(left, right):
                tile = row * columns + column
                entries[cursor[tile]] = splat
                cursor[tile] += 1
    return starts, entries
