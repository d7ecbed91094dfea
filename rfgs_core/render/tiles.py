# SPDX-License-Identifier: Apache-2.0
"""Which Gaussians touch which 16 × 16 tile of a picture, nearest first."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
import torch
from jaxtyping import Bool, Float64, Int32, Int64

from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.blending import blend
from rfgs_core.render.cameras import Camera
from rfgs_core.render.hidden import LIGHT_MIN, mark_in_sight
from rfgs_core.render.projection import eye_of, project
from rfgs_core.render.splat import ALPHA_MIN, TILE_PX

#: Visible Gaussians from which on it pays to ask which of them are hidden.
LOOK_FROM = 50_000
#: Share of them, the nearest, that are asked what they hide.
_FRONT = 0.125
#: It pays where Gaussians cover at most this much on average [px²]: larger ones cost more to draw
#: than to sort, and those behind them are left out while they are drawn.
_LARGEST_PX2 = 8.0
#: Gaussians that all this is estimated from, about.
_SAMPLE = 10_000


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


def tile_splats(
    gaussians: Gaussians, camera: Camera, leave_out_hidden: bool = False
) -> TiledSplats:
    """Projects Gaussians (formulas in `splat.py`), culls, sorts by depth and fills the tiles.

    Equal depths keep the order of the set, so that the picture does not depend on threads.

    Args:
        gaussians: M Gaussians.
        camera: Where to look from.
        leave_out_hidden: Whether crowds that are small in the picture lose what their nearest hide
            (`hidden.py`) before they are sorted.
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
    front_m = _hiding_depth(splats, depths, rows) if leave_out_hidden else None
    if front_m is not None:
        near = depths[rows] <= front_m
        front = _sorted_tiles(rows[near], splats, depths, bounds, camera)
        far = rows[~near]
        rows = np.concatenate([rows[near], far[_in_sight(front, splats, far)]])
    return _sorted_tiles(rows, splats, depths, bounds, camera)


def _hiding_depth(splats: np.ndarray, depths: np.ndarray, rows: np.ndarray) -> float | None:
    """Depth up to which Gaussians may hide all others [m]; None if there are too few for that.

    One with opacity o and covariance Σ' takes 2π √|Σ'| (o − `ALPHA_MIN`) pixels of light, faint
    parts not counted. Spread over the area of a rectangle of the same variances, the nearest are
    enough where they take ln(1 / `LIGHT_MIN`) of each pixel.
    """
    if len(rows) < LOOK_FROM:
        return None
    sample = rows[:: 1 + len(rows) // _SAMPLE]
    few = splats[sample]
    # A needle of any length has no determinant left after rounding; it counts as large.
    determinant = np.maximum(few[:, 2] * few[:, 4] - few[:, 3] ** 2, 1e-12)
    covers = 2.0 * np.pi / np.sqrt(determinant)
    area = covers.mean() + 12.0 * few[:, 0].std() * few[:, 1].std()
    layers = len(rows) * (covers * (few[:, 5] - ALPHA_MIN)).mean() / area
    if covers.mean() > _LARGEST_PX2 or _FRONT * layers < -np.log(LIGHT_MIN):
        return None
    return float(np.quantile(depths[sample], _FRONT))


def _in_sight(front: TiledSplats, splats: np.ndarray, far: np.ndarray) -> Bool[np.ndarray, "R"]:
    """Which of the splats in rows `far`, all behind `front`, that does not hide."""
    cover = np.zeros((front.height, front.width, 1))
    blend(cover, np.zeros((len(front.splats), 0)), front.splats, front.starts, front.entries)
    shown = np.zeros(len(far), np.bool_)
    mark_in_sight(shown, 1.0 - cover[..., 0], splats, far)
    return shown


def _sorted_tiles(
    rows: np.ndarray, splats: np.ndarray, depths: np.ndarray, bounds: np.ndarray, camera: Camera
) -> TiledSplats:
    """Tiles of these rows of what `project` wrote."""
    rows = rows[np.argsort(depths[rows], kind="stable")]
    tile_bounds = bounds[rows]
    tile_bounds[:, 1::2] += TILE_PX - 1
    tile_bounds //= TILE_PX
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
