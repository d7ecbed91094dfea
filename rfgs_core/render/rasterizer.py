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
from rfgs_core.propagation.vector_math import FAST_REDUCTION, exponential
from rfgs_core.render.cameras import Camera
from rfgs_core.render.gpu import GpuSplats
from rfgs_core.render.splat import ALPHA_MAX, TILE_PX, FrozenSplats, Splatted
from rfgs_core.render.tiles import TiledSplats, tile_splats

#: A tile is finished when less light than this passes anywhere; bounds the error of stopping early.
LIGHT_MIN = 1e-5
#: Splats after which a tile is looked at again.
_LOOK_EVERY = 16

#: Pictures with fewer tile entries are drawn by one thread: waking others takes longer.
SMALL_ENTRIES = 4096

_OPTIONS: Any = {"fastmath": FAST_REDUCTION, "cache": True, "error_model": "numpy"}


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
        return Splatted(rgb=_blended(rgb, self.tiles)[0], alpha=self.alpha, depth=self.depth)


def plan_splats(gaussians: Gaussians, camera: Camera) -> FrozenSplats:
    """Projects and sorts M Gaussians for one camera, on their device; detached from autograd.

    Raises:
        MissingToolError: They are on a GPU, and gsplat is not installed.
    """
    if gaussians.means.is_cuda:
        return GpuSplats.of(gaussians, camera)
    tiles = tile_splats(gaussians, camera)
    depths, alpha = _blend(tiles.depths[:, None].astype(np.float32), tiles)
    return SplatPlan(tiles, *_coverage(torch.from_numpy(alpha), torch.from_numpy(depths)))


def _coverage(
    alpha: Float[Tensor, "H W"], depths: Float[Tensor, "H W 1"]
) -> tuple[Float[Tensor, "H W"], Float[Tensor, "H W"]]:
    """Share covered, and the expected depth of blended depths."""
    return alpha, torch.where(alpha > 0.0, depths[..., 0] / alpha, torch.inf)


def splat(gaussians: Gaussians, rgb: Float[Tensor, "M 3"], camera: Camera) -> Splatted:
    """Renders Gaussians with given colours.

    Args:
        gaussians: M Gaussians; taken as constants.
        rgb: Colours in [0, 1], shape [M, 3], on the same device, or any number of values each;
            gradients flow into them.
        camera: Where to look from.

    Returns:
        The picture, on that device, colours in the precision of `rgb`.

    Example:
        >>> camera = Camera("front", 4, 4, 4.0, 4.0, 2.0, 2.0, np.eye(4))
        >>> splat(Gaussians.none(), torch.zeros(0, 3), camera).alpha.sum().item()
        0.0
    """
    if gaussians.means.is_cuda:
        return GpuSplats.of(gaussians, camera).draw(rgb)
    tiles = tile_splats(gaussians, camera)
    depths = np.zeros((len(rgb), 1))
    depths[tiles.rows, 0] = tiles.depths
    # Colours and depths in one walk through the tiles.
    values = torch.cat([rgb, torch.from_numpy(depths).to(rgb)], dim=1)
    blended, cover = _blended(values, tiles)
    alpha, depth = _coverage(cover, blended.detach()[..., -1:].float())
    return Splatted(rgb=blended[..., :-1], alpha=alpha, depth=depth)


def _blended(
    values: Float[Tensor, "M C"], tiles: TiledSplats
) -> tuple[Float[Tensor, "H W C"], Float[Tensor, "H W"]]:
    """Blended values, and the share of each pixel that is covered, without gradient."""
    return _Blend.apply(values, tiles)  # type: ignore[return-value]


def _blend(values: np.ndarray, tiles: TiledSplats) -> tuple[np.ndarray, np.ndarray]:
    """Blended values [H, W, C], and the share that is covered [H, W]."""
    channels = values.shape[1]
    picture = np.zeros((tiles.height, tiles.width, channels + 1), values.dtype)
    with _threads_for(tiles):
        _blend_tiles(picture, values, tiles.splats, tiles.starts, tiles.entries)
    return np.ascontiguousarray(picture[..., :channels]), picture[..., channels].astype(np.float32)


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
    def forward(ctx: Any, values: Tensor, tiles: TiledSplats) -> tuple[Tensor, Tensor]:
        ctx.tiles, ctx.shape = tiles, values.shape
        picture, cover = map(torch.from_numpy, _blend(values.detach().numpy()[tiles.rows], tiles))
        ctx.mark_non_differentiable(cover)
        return picture, cover

    @staticmethod
    def backward(ctx: Any, *grad_outputs: Tensor) -> tuple[Tensor, None]:
        grad, _ = grad_outputs
        tiles: TiledSplats = ctx.tiles
        towards = np.ascontiguousarray(grad.detach().numpy())
        shares = np.zeros((len(tiles.entries), towards.shape[2]), towards.dtype)
        with _threads_for(tiles):
            _blend_backward_tiles(shares, towards, tiles.splats, tiles.starts, tiles.entries)
        total = np.zeros(ctx.shape)
        _sum_shares(total, shares, tiles.entries, tiles.rows)
        return torch.from_numpy(total).to(grad), None


@numba.njit(inline="always", **_OPTIONS)
def _tile_corner(tile: int, width: int, height: int) -> tuple[int, int, int, int]:
    """First and one-past-last column and row of a tile."""
    columns = (width + TILE_PX - 1) // TILE_PX
    left, top = (tile % columns) * TILE_PX, (tile // columns) * TILE_PX
    return left, min(width, left + TILE_PX), top, min(height, top + TILE_PX)


@numba.njit(inline="always", **_OPTIONS)
def _rows_reached(splat: np.ndarray, top: int) -> tuple[int, int]:
    """Rows of a tile where a splat may reach `ALPHA_MIN`, a pixel of margin on both sides."""
    a, b, c = splat[2], splat[3], splat[4]
    half = np.sqrt(2.0 * splat[6] * a / (a * c - b * b)) + 1.0
    middle = splat[1] - top - 0.5
    # Cut before they are whole numbers, which hold no splat of any size.
    first = min(max(np.floor(middle - half), 0.0), float(TILE_PX))
    last = min(max(np.ceil(middle + half) + 1.0, first), float(TILE_PX))
    return int(first), int(last)


@numba.njit(inline="always", **_OPTIONS)
def _take_light(
    light: np.ndarray,  # [TILE_PX * TILE_PX], row after row
    share: np.ndarray,  # [TILE_PX * TILE_PX]
    splat: np.ndarray,
    rows: tuple[int, int],
    left: int,
    top: int,
) -> None:
    """Writes the share that a splat gives to the pixels of these rows, and takes it from the light.

    No branch, so that a row of a tile is a few vectors. The exponent is in double whatever the
    precision of the light: whether it is within reach is what the plain twin finds too.
    """
    real = light.dtype.type
    x, half_a, b, reach = splat[0] - left - 0.5, 0.5 * splat[2], splat[3], splat[6]
    opacity, most = real(splat[5]), real(ALPHA_MAX)
    for row in range(rows[0], rows[1]):
        dy = row + top + 0.5 - splat[1]
        by_row, along = 0.5 * splat[4] * dy * dy, b * dy
        pixels = slice(row * TILE_PX, (row + 1) * TILE_PX)
        lit, given = light[pixels], share[pixels]
        for column in range(TILE_PX):
            dx = column - x
            power = (half_a * dx + along) * dx + by_row
            alpha = opacity * exponential(real(-power))
            alpha = min(alpha, most) * real(power <= reach)
            given[column] = lit[column] * alpha
            lit[column] -= given[column]


@numba.njit(inline="always", **_OPTIONS)
def _is_dark(light: np.ndarray) -> bool:
    """Whether no pixel of a tile passes `LIGHT_MIN` any more."""
    most = light[0]
    for pixel in range(TILE_PX * TILE_PX):
        most = max(most, light[pixel])
    return most < LIGHT_MIN


@numba.njit(inline="always", **_OPTIONS)
def _add(sums: np.ndarray, share: np.ndarray, values: np.ndarray, rows: tuple[int, int]) -> None:
    """Adds what a splat gives to rows of a tile: its values, then its share itself."""
    channels = len(values)
    for channel in range(channels + 1):
        total = sums[channel]
        value = values[channel] if channel < channels else sums.dtype.type(1.0)
        for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
            total[pixel] += share[pixel] * value


@numba.njit(parallel=True, **_OPTIONS)
def _blend_tiles(
    picture: np.ndarray,  # [H, W, C + 1]: values, then the share that is covered
    values: np.ndarray,  # [S, C]
    splats: np.ndarray,  # [S, 7]
    starts: np.ndarray,  # [T + 1]
    entries: np.ndarray,  # [E]
) -> None:
    height, width, channels = picture.shape
    for tile in numba.prange(len(starts) - 1):
        left, right, top, bottom = _tile_corner(tile, width, height)
        light = np.ones(TILE_PX * TILE_PX, values.dtype)
        share = np.zeros(TILE_PX * TILE_PX, values.dtype)
        sums = np.zeros((channels, TILE_PX * TILE_PX), values.dtype)
        for entry in range(starts[tile], starts[tile + 1]):
            if (entry - starts[tile]) % _LOOK_EVERY == _LOOK_EVERY - 1 and _is_dark(light):
                break
            splat = splats[entries[entry]]
            rows = _rows_reached(splat, top)
            _take_light(light, share, splat, rows, left, top)
            _add(sums, share, values[entries[entry]], rows)
        for row in range(top, bottom):
            for column in range(left, right):
                picture[row, column] = sums[:, (row - top) * TILE_PX + column - left]


@numba.njit(parallel=True, **_OPTIONS)
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
        light = np.ones(TILE_PX * TILE_PX, towards.dtype)
        share = np.zeros(TILE_PX * TILE_PX, towards.dtype)
        slopes = np.zeros((channels, TILE_PX * TILE_PX), towards.dtype)
        for channel in range(channels):
            for row in range(top, bottom):
                for column in range(left, right):
                    pixel = (row - top) * TILE_PX + column - left
                    slopes[channel, pixel] = towards[row, column, channel]
        for entry in range(starts[tile], starts[tile + 1]):
            if (entry - starts[tile]) % _LOOK_EVERY == _LOOK_EVERY - 1 and _is_dark(light):
                break
            splat = splats[entries[entry]]
            rows = _rows_reached(splat, top)
            _take_light(light, share, splat, rows, left, top)
            for channel in range(channels):
                total, slope = towards.dtype.type(0.0), slopes[channel]
                for pixel in range(rows[0] * TILE_PX, rows[1] * TILE_PX):
                    total += share[pixel] * slope[pixel]
                shares[entry, channel] = total


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
