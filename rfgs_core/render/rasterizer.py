# SPDX-License-Identifier: Apache-2.0
"""The tiled rasteriser for CPUs: same picture and gradients as `reference.py`.

Where Gaussians are constants, as in the fit of colours, a picture is linear in the colours and the
way back is one more walk through the tiles; where they ask for gradients, it is three.
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
from rfgs_core.render.blending import blend, shape_shares, sum_shares, value_shares
from rfgs_core.render.cameras import Camera
from rfgs_core.render.gpu import GpuSplats, splat_on_gpu
from rfgs_core.render.projection import eye_of, project_back
from rfgs_core.render.splat import FrozenSplats, Splatted
from rfgs_core.render.tiles import TiledSplats, contiguous, tile_splats

#: Pictures with fewer tile entries are drawn by one thread: waking others takes longer.
SMALL_ENTRIES = 4096
#: Columns of `TiledSplats.splats` that Gaussians move: centre, inverse covariance, opacity.
_ELLIPSE = 6


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
        picture, _ = _blended(rgb[self.tiles.rows], None, self.tiles)
        return Splatted(rgb=picture, alpha=self.alpha, depth=self.depth)


def plan_splats(gaussians: Gaussians, camera: Camera) -> FrozenSplats:
    """Projects and sorts M Gaussians for one camera, on their device; detached from autograd.

    Raises:
        MissingToolError: They are on a GPU, and gsplat is not installed.
    """
    if gaussians.means.is_cuda:
        return GpuSplats.of(gaussians, camera)
    tiles = tile_splats(gaussians, camera)
    depths, alpha = _blended(torch.from_numpy(tiles.depths[:, None]).float(), None, tiles)
    return SplatPlan(tiles, alpha, _expected(depths[..., 0], alpha))


def splat(
    gaussians: Gaussians,
    rgb: Float[Tensor, "M 3"],
    camera: Camera,
    leave_out_hidden: bool = True,
) -> Splatted:
    """Renders Gaussians with given colours.

    Args:
        gaussians: M Gaussians; gradients flow into those of their tensors that ask for them.
        rgb: Colours in [0, 1], shape [M, 3], on the same device, or any number of values each;
            gradients flow into them.
        camera: Where to look from.
        leave_out_hidden: Whether crowds that are small in the picture lose what their nearest hide
            before they are sorted: quicker, within `LIGHT_MIN` of full brightness. On CPUs, and
            only where nothing asks for gradients.

    Returns:
        The picture, on that device, colours in the precision of `rgb`.

    Raises:
        MissingToolError: They are on a GPU, and gsplat is not installed.

    Example:
        >>> camera = Camera("front", 4, 4, 4.0, 4.0, 2.0, 2.0, np.eye(4))
        >>> splat(Gaussians.none(), torch.zeros(0, 3), camera).alpha.sum().item()
        0.0
    """
    if gaussians.means.is_cuda:
        return Splatted(*splat_on_gpu(gaussians, rgb, camera))
    shape = (gaussians.means, gaussians.quats, gaussians.log_scales, gaussians.logit_opacities)
    shaped = torch.is_grad_enabled() and any(part.requires_grad for part in shape)
    fitted = shaped or (torch.is_grad_enabled() and rgb.requires_grad)
    tiles = tile_splats(gaussians, camera, leave_out_hidden and not fitted)
    if shaped:
        ellipses, depths = _Project.apply(*shape, camera, tiles)  # type: ignore[misc]
    else:
        ellipses, depths = None, torch.from_numpy(tiles.depths)
    # Colours and depths in one walk through the tiles.
    values = torch.cat([rgb[tiles.rows], depths[:, None].to(rgb)], dim=1)
    blended, alpha = _blended(values, ellipses, tiles)
    depth = blended[..., -1] if ellipses is not None else blended.detach()[..., -1]
    return Splatted(rgb=blended[..., :-1], alpha=alpha, depth=_expected(depth.float(), alpha))


def _expected(depths: Float[Tensor, "H W"], alpha: Float[Tensor, "H W"]) -> Float[Tensor, "H W"]:
    """Expected depth of blended depths."""
    # Not below what float32 holds, so that its slope is a number where nothing is drawn.
    return torch.where(alpha > 0.0, depths / alpha.clamp_min(1e-12), torch.inf)


def _blended(
    values: Float[Tensor, "S C"], ellipses: Float[Tensor, "S 6"] | None, tiles: TiledSplats
) -> tuple[Float[Tensor, "H W C"], Float[Tensor, "H W"]]:
    """Blended values of splats, and the share of each pixel that is covered."""
    return _Blend.apply(values, ellipses, tiles)  # type: ignore[return-value]


@contextmanager
def _threads_for(tiles: TiledSplats) -> Iterator[None]:
    before = numba.get_num_threads()
    numba.set_num_threads(1 if len(tiles.entries) < SMALL_ENTRIES else before)
    try:
        yield
    finally:
        numba.set_num_threads(before)


class _Project(torch.autograd.Function):
    """Gaussians to the ellipses and depths that tiles hold already, and back."""

    @staticmethod
    def forward(ctx: Any, *given: Any) -> tuple[Tensor, Tensor]:
        *parts, camera, tiles = given
        ctx.save_for_backward(*parts)
        ctx.camera, ctx.tiles = camera, tiles
        ellipses = np.ascontiguousarray(tiles.splats[:, :_ELLIPSE])
        return torch.from_numpy(ellipses), torch.from_numpy(tiles.depths)

    @staticmethod
    def backward(ctx: Any, *grad_outputs: Tensor) -> tuple[Tensor | None, ...]:
        parts, camera, tiles = ctx.saved_tensors, ctx.camera, ctx.tiles
        means, quats, log_scales, _ = map(contiguous, parts)
        to_ellipses, to_depths = map(contiguous, grad_outputs)
        slopes = to_means, to_quats, to_log_scales, to_logits = (
            np.zeros(means.shape),
            np.zeros(quats.shape),
            np.zeros(log_scales.shape),
            np.zeros(len(means)),
        )
        project_back(
            means,
            quats,
            log_scales,
            np.ascontiguousarray(camera.view_from_world),
            eye_of(camera),
            (camera.width, camera.height),
            tiles.rows,
            tiles.splats,
            to_ellipses,
            to_depths,
            to_means,
            to_quats,
            to_log_scales,
            to_logits,
        )
        pairs = zip(slopes, parts, strict=True)
        return (*(torch.from_numpy(slope).to(part) for slope, part in pairs), None, None)


class _Blend(torch.autograd.Function):
    """Splats to a picture, and back."""

    @staticmethod
    def forward(
        ctx: Any, values: Tensor, ellipses: Tensor | None, tiles: TiledSplats
    ) -> tuple[Tensor, Tensor]:
        ctx.tiles, ctx.shaped = tiles, ellipses is not None
        ctx.save_for_backward(values)
        shape = (tiles.height, tiles.width, values.shape[1] + 1)
        drawn = contiguous(values)
        picture = np.zeros(shape, drawn.dtype)
        with _threads_for(tiles):
            blend(picture, drawn, tiles.splats, tiles.starts, tiles.entries)
        cover = torch.from_numpy(picture[..., -1].astype(np.float32))
        if ellipses is None:
            ctx.mark_non_differentiable(cover)
        return torch.from_numpy(np.ascontiguousarray(picture[..., :-1])), cover

    @staticmethod
    def backward(ctx: Any, *grad_outputs: Tensor) -> tuple[Tensor, Tensor | None, None]:
        to_picture, to_cover = grad_outputs
        tiles: TiledSplats = ctx.tiles
        (values,) = ctx.saved_tensors
        drawn = contiguous(values)
        ways = (tiles.splats, tiles.starts, tiles.entries)
        to_values = np.zeros((len(tiles.entries), drawn.shape[1]), drawn.dtype)
        with _threads_for(tiles):
            value_shares(to_values, contiguous(to_picture), *ways)
        found = _summed(to_values, tiles).to(values)
        if not ctx.shaped:
            return found, None, None
        towards = torch.cat([to_picture, to_cover[..., None].to(to_picture)], dim=-1)
        to_ellipses = np.zeros((len(tiles.entries), _ELLIPSE))
        with _threads_for(tiles):
            shape_shares(to_ellipses, contiguous(towards), drawn, *ways)
        return found, _summed(to_ellipses, tiles), None


def _summed(shares: np.ndarray, tiles: TiledSplats) -> Tensor:
    """From entries of tiles to their splats, in double precision."""
    total = np.zeros((len(tiles.splats), shares.shape[1]))
    sum_shares(total, shares, tiles.entries)
    return torch.from_numpy(total)
