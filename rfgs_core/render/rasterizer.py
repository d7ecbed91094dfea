# SPDX-License-Identifier: Apache-2.0
"""The tiled rasteriser for CPUs: same picture as `reference.py`, with gradients to colours.

Geometry is frozen while colours are fitted, so a picture is linear in the colours and the backward
pass is the same walk through the tiles. Threads share tiles, never a sum: results are the same
bytes for any number of threads.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.gpu import GpuSplats
from rfgs_core.render.splat import ALPHA_MAX, ALPHA_MIN, TILE_PX, FrozenSplats, Splatted
from rfgs_core.render.tiles import TiledSplats, tile_splats

#: A pixel is finished when less light than this passes; bounds the error of stopping early.
LIGHT_MIN = 1e-5

#: Pictures with fewer tile entries are drawn by one thread: waking others takes longer.
SMALL_ENTRIES = 4096


@dataclass(frozen=True)
class SplatPlan:
    """Frozen Gaussians in front of a camera, on the CPU; see `FrozenSplats`."""

    tiles: TiledSplats
    """Splats by tile."""
    alpha: Float[Tensor, "H W"]
    """Share of each pixel that is covered."""
    depth: Float[Tensor, "H W"]
    """Expected planar depth [m], +inf where nothing covers the pixel."""

    def draw(self, rgb: Float[Tensor, "M 3"]) -> Splatted:
        """The picture with these colours; gradients flow into `rgb`, never into the Gaussians."""
        picture: Tensor = _Blend.apply(rgb, self.tiles)  # type: ignore[assignment]
        return Splatted(rgb=picture, alpha=self.alpha, depth=self.depth)


def plan_splats(gaussians: Gaussians, camera: Camera) -> FrozenSplats:
    """Projects and sorts M Gaussians for one camera, on their device; detached from autograd.

    Raises:
        MissingToolError: They are on a GPU, and gsplat is not installed.
    """
    if gaussians.means.is_cuda:
        return GpuSplats.of(gaussians, camera)
    tiles = tile_splats(gaussians, camera)
    ones_and_depths = np.stack([np.ones_like(tiles.depths), tiles.depths], axis=1)
    blended = _blend(ones_and_depths, tiles)
    alpha = blended[..., 0]
    covered = alpha > 0.0
    depth = np.full(alpha.shape, np.inf)
    depth[covered] = blended[covered, 1] / alpha[covered]
    return SplatPlan(
        tiles=tiles,
        alpha=torch.from_numpy(alpha.astype(np.float32)),
        depth=torch.from_numpy(depth.astype(np.float32)),
    )


def splat(gaussians: Gaussians, rgb: Float[Tensor, "M 3"], camera: Camera) -> Splatted:
    """Renders Gaussians with given colours.

    Args:
        gaussians: M Gaussians; taken as constants.
        rgb: Colours in [0, 1], shape [M, 3], on the same device; gradients flow into them.
        camera: Where to look from.

    Returns:
        The picture, on that device, colours in the precision of `rgb`.

    Example:
        >>> camera = Camera("front", 4, 4, 4.0, 4.0, 2.0, 2.0, np.eye(4))
        >>> splat(Gaussians.none(), torch.zeros(0, 3), camera).alpha.sum().item()
        0.0
    """
    return plan_splats(gaussians, camera).draw(rgb)


def _blend(values: np.ndarray, tiles: TiledSplats) -> np.ndarray:
    picture = np.zeros((tiles.height, tiles.width, values.shape[1]))
    with _threads_for(tiles):
        _blend_tiles(picture, values, tiles.splats, tiles.starts, tiles.entries)
    return picture


@contextmanager
def _threads_for(tiles: TiledSplats) -> Iterator[None]:
    before = numba.get_num_threads()
    numba.set_num_threads(1 if len(tiles.entries) < SMALL_ENTRIES else before)
    try:
        yield
    finally:
        numba.set_num_threads(before)


class _Blend(torch.autograd.Function):
    """Colours to picture, and back through the transposed weights."""

    @staticmethod
    def forward(ctx: Any, rgb: Tensor, tiles: TiledSplats) -> Tensor:
        ctx.tiles, ctx.shape = tiles, rgb.shape
        values = rgb.detach().cpu().numpy().astype(np.float64)[tiles.rows]
        return torch.from_numpy(_blend(np.ascontiguousarray(values), tiles)).to(rgb)

    @staticmethod
    def backward(ctx: Any, *grad_outputs: Tensor) -> tuple[Tensor, None]:
        (grad,) = grad_outputs
        tiles: TiledSplats = ctx.tiles
        towards = np.ascontiguousarray(grad.detach().cpu().numpy().astype(np.float64))
        shares = np.zeros((len(tiles.entries), towards.shape[2]))
        with _threads_for(tiles):
            _blend_backward_tiles(shares, towards, tiles.splats, tiles.starts, tiles.entries)
        total = np.zeros(ctx.shape)
        _sum_shares(total, shares, tiles.entries, tiles.rows)
        return torch.from_numpy(total).to(grad), None


@numba.njit(inline="always")
def _span(splat: np.ndarray, row: int, left: int, right: int) -> tuple[int, int]:
    """Columns in [left, right) of one row where a splat may reach `ALPHA_MIN`.

    Solves a dx² + 2 b dx dy + c dy² ≤ 2 · reach for dx, a pixel of margin on both sides.
    """
    a, b, c, reach = splat[2], splat[3], splat[4], splat[6]
    dy = row + 0.5 - splat[1]
    middle = splat[0] - b / a * dy
    room = (2.0 * reach - (c - b * b / a) * dy * dy) / a
    if room < 0.0:
        room = 0.0
    half = np.sqrt(room) + 1.0
    first = max(left, min(right, int(np.floor(middle - half - 0.5))))
    last = max(left, min(right, int(np.ceil(middle + half + 0.5))))
    return first, last


@numba.njit(inline="always")
def _alpha(splat: np.ndarray, row: int, column: int) -> float:
    """What one splat covers of a pixel, zero below `ALPHA_MIN`."""
    dx, dy = column + 0.5 - splat[0], row + 0.5 - splat[1]
    power = 0.5 * (splat[2] * dx * dx + splat[4] * dy * dy) + splat[3] * dx * dy
    if power > splat[6] + 1e-6:
        return 0.0
    alpha = min(ALPHA_MAX, splat[5] * np.exp(-power))
    return alpha if alpha >= ALPHA_MIN else 0.0


@numba.njit(inline="always")
def _take_light(
    light: np.ndarray, splat: np.ndarray, row: int, column: int, top: int, left: int
) -> float:
    """Share of a pixel that one splat gives, taken from the light that still passes there."""
    passing = light[row - top, column - left]
    if passing < LIGHT_MIN:
        return 0.0
    alpha = _alpha(splat, row, column)
    light[row - top, column - left] = passing * (1.0 - alpha)
    return passing * alpha


@numba.njit(inline="always")
def _tile_corner(tile: int, width: int, height: int) -> tuple[int, int, int, int]:
    """First and one-past-last column and row of a tile."""
    columns = (width + TILE_PX - 1) // TILE_PX
    left, top = (tile % columns) * TILE_PX, (tile // columns) * TILE_PX
    return left, min(width, left + TILE_PX), top, min(height, top + TILE_PX)


@numba.njit(parallel=True, cache=True)
def _blend_tiles(
    picture: np.ndarray,  # [H, W, C], zero on entry
    values: np.ndarray,  # [S, C]
    splats: np.ndarray,  # [S, 7]
    starts: np.ndarray,  # [T + 1]
    entries: np.ndarray,  # [E]
) -> None:
    height, width, channels = picture.shape
    for tile in numba.prange(len(starts) - 1):
        left, right, top, bottom = _tile_corner(tile, width, height)
        light = np.ones((TILE_PX, TILE_PX))
        open_pixels = (right - left) * (bottom - top)
        for entry in range(starts[tile], starts[tile + 1]):
            if open_pixels == 0:
                break
            splat = splats[entries[entry]]
            value = values[entries[entry]]
            for row in range(top, bottom):
                first, last = _span(splat, row, left, right)
                for column in range(first, last):
                    share = _take_light(light, splat, row, column, top, left)
                    if share == 0.0:
                        continue
                    for channel in range(channels):
                        picture[row, column, channel] += share * value[channel]
                    open_pixels -= light[row - top, column - left] < LIGHT_MIN


@numba.njit(parallel=True, cache=True)
def _blend_backward_tiles(
    shares: np.ndarray,  # [E, C], zero on entry
    towards: np.ndarray,  # [H, W, C], gradient with respect to the picture
    splats: np.ndarray,  # [S, 7]
    starts: np.ndarray,  # [T + 1]
    entries: np.ndarray,  # [E]
) -> None:
    height, width, channels = towards.shape
    for tile in numba.prange(len(starts) - 1):
        left, right, top, bottom = _tile_corner(tile, width, height)
        light = np.ones((TILE_PX, TILE_PX))
        open_pixels = (right - left) * (bottom - top)
        for entry in range(starts[tile], starts[tile + 1]):
            if open_pixels == 0:
                break
            splat = splats[entries[entry]]
            for row in range(top, bottom):
                first, last = _span(splat, row, left, right)
                for column in range(first, last):
                    share = _take_light(light, splat, row, column, top, left)
                    if share == 0.0:
                        continue
                    for channel in range(channels):
                        shares[entry, channel] += share * towards[row, column, channel]
                    open_pixels -= light[row - top, column - left] < LIGHT_MIN


@numba.njit(cache=True)
def _sum_shares(
    total: np.ndarray,  # [M, C]
    shares: np.ndarray,  # [E, C]
    entries: np.ndarray,  # [E]
    rows: np.ndarray,  # [S]
) -> None:
    for entry in range(shares.shape[0]):
        for channel in range(shares.shape[1]):
            total[rows[entries[entry]], channel] += shares[entry, channel]
