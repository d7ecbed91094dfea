# SPDX-License-Identifier: Apache-2.0
"""Which Gaussians touch which 16 × 16 tile of a picture, nearest first."""

from __future__ import annotations

from dataclasses import dataclass

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
    view = camera.to_view(_array(gaussians.means))
    opacities = 1.0 / (1.0 + np.exp(-_array(gaussians.logit_opacities)))
    near = np.flatnonzero((view[:, 2] > NEAR_M) & (opacities >= ALPHA_MIN))
    rows = near[np.argsort(view[near, 2], kind="stable")]
    view, opacities = view[rows], opacities[rows]
    covariances = _project_covariances(gaussians, camera, rows, view)
    reach = np.log(opacities / ALPHA_MIN)
    centre_x = camera.fl_x * view[:, 0] / view[:, 2] + camera.cx
    centre_y = camera.fl_y * view[:, 1] / view[:, 2] + camera.cy
    bounds = _pixel_bounds(centre_x, centre_y, covariances, reach, camera)
    seen = (bounds[:, 0] < bounds[:, 1]) & (bounds[:, 2] < bounds[:, 3])
    var_x, cov_xy, var_y = covariances.T
    determinant = var_x * var_y - cov_xy**2
    conic = [var_y / determinant, -cov_xy / determinant, var_x / determinant]
    splats = np.stack([centre_x, centre_y, *conic, opacities, reach], axis=1)[seen]
    tile_bounds = bounds[seen] // TILE_PX
    tile_bounds[:, 1::2] = -(-bounds[seen][:, 1::2] // TILE_PX)
    columns = -(-camera.width // TILE_PX)
    count = columns * -(-camera.height // TILE_PX)
    starts, entries = _fill_tiles(tile_bounds, columns, count)
    return TiledSplats(
        width=camera.width,
        height=camera.height,
        rows=rows[seen],
        splats=np.ascontiguousarray(splats),
        depths=view[seen, 2],
        starts=starts,
        entries=entries,
    )


def _array(values: torch.Tensor) -> np.ndarray:
    return values.detach().cpu().numpy().astype(np.float64)


def _project_covariances(
    gaussians: Gaussians, camera: Camera, rows: np.ndarray, view: np.ndarray
) -> np.ndarray:
    """Dilated covariances in the picture, columns (xx, xy, yy) [px²], shape [S, 3]."""
    quats = _array(gaussians.quats)[rows]
    w, x, y, z = (quats / np.linalg.norm(quats, axis=1, keepdims=True)).T
    scales = np.exp(_array(gaussians.log_scales)[rows])
    axes = (
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1),
        np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1),
        np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1),
    )
    depth = view[:, 2]
    limit_x = SLOPE_MARGIN * 0.5 * camera.width / camera.fl_x
    limit_y = SLOPE_MARGIN * 0.5 * camera.height / camera.fl_y
    slope_x = np.clip(view[:, 0] / depth, -limit_x, limit_x)
    slope_y = np.clip(view[:, 1] / depth, -limit_y, limit_y)
    covariances = np.zeros((len(rows), 3))
    covariances[:, [0, 2]] = DILATION_PX2
    rotation = camera.view_from_world[:3, :3]
    for index, axis in enumerate(axes):
        # Each principal axis is a small arrow; its picture is J applied to it.
        arrow = (axis * scales[:, index : index + 1]) @ rotation.T
        across = camera.fl_x / depth * (arrow[:, 0] - slope_x * arrow[:, 2])
        down = camera.fl_y / depth * (arrow[:, 1] - slope_y * arrow[:, 2])
        covariances += np.stack([across * across, across * down, down * down], axis=1)
    return covariances


def _pixel_bounds(
    centre_x: np.ndarray,
    centre_y: np.ndarray,
    covariances: np.ndarray,
    reach: np.ndarray,
    camera: Camera,
) -> np.ndarray:
    """First and one-past-last column and row whose centres a splat may reach, shape [S, 4]."""
    half_x = np.sqrt(2.0 * reach * covariances[:, 0])
    half_y = np.sqrt(2.0 * reach * covariances[:, 2])
    limits = [
        (np.floor(centre_x - half_x - 0.5), camera.width),
        (np.ceil(centre_x + half_x + 0.5), camera.width),
        (np.floor(centre_y - half_y - 0.5), camera.height),
        (np.ceil(centre_y + half_y + 0.5), camera.height),
    ]
    return np.stack([np.clip(value, 0, size) for value, size in limits], axis=1).astype(np.int64)


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
