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
from rfgs_core.render.projection import eye_of, project
from rfgs_core.render.splat import TILE_PX


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
    project(
        contiguous(gaussians.means),
        contiguous(gaussians.quats),
        contiguous(gaussians.log_scales),
        contiguous(gaussians.logit_opacities),
        np.ascontiguousarray(camera.view_from_world),
        eye_of(camera),
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


def contiguous(values: torch.Tensor) -> np.ndarray:
    """A tensor as kernels take it: without gradient, rows one after the other."""
    return np.ascontiguousarray(values.detach().numpy())


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
