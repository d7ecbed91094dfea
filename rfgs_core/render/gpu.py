# SPDX-License-Identifier: Apache-2.0
"""The rasteriser on a GPU: gsplat (Ye et al., 2025), asked for the picture of `splat.py`.

It differs from the twins in two ways. A pixel stops before the Gaussian behind which less than
1e-4 of the light would pass, so that up to 1e-4 / (1 − a) of full brightness is missing, a being
that Gaussian's contribution. And opacities are cut at `ALPHA_MAX`, not contributions. Gradients
flow into Gaussians and colours alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.extras import require
from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.splat import ALPHA_MAX, DILATION_PX2, NEAR_M, TILE_PX, Splatted


def splat_on_gpu(
    gaussians: Gaussians, values: Float[Tensor, "M C"], camera: Camera
) -> tuple[Float[Tensor, "H W C"], Float[Tensor, "H W"], Float[Tensor, "H W"]]:
    """Renders Gaussians with any number of values each.

    Args:
        gaussians: M Gaussians on a GPU.
        values: Colours or features on the same GPU, shape [M, C].
        camera: Where to look from.

    Returns:
        Values weighted along each pixel, share covered, and expected planar depth [m], +inf where
        nothing covers the pixel.

    Raises:
        MissingToolError: gsplat is not installed.
    """
    require("gsplat")
    from gsplat import rasterization

    device = gaussians.means.device
    intrinsics = [[camera.fl_x, 0.0, camera.cx], [0.0, camera.fl_y, camera.cy], [0.0, 0.0, 1.0]]
    view = np.ascontiguousarray(camera.view_from_world, dtype=np.float32)
    picture, alpha, _ = rasterization(
        means=gaussians.means.float(),
        quats=gaussians.quats.float(),
        scales=torch.exp(gaussians.log_scales.float()),
        opacities=torch.sigmoid(gaussians.logit_opacities.float()).clamp_max(ALPHA_MAX),
        colors=values.float(),
        viewmats=torch.from_numpy(view)[None].to(device),
        Ks=torch.tensor(intrinsics, device=device)[None],
        width=camera.width,
        height=camera.height,
        near_plane=NEAR_M,
        eps2d=DILATION_PX2,
        tile_size=TILE_PX,
        render_mode="RGB+ED",
    )
    cover = alpha[0, ..., 0]
    depth = torch.where(cover > 0.0, picture[0, ..., -1], torch.inf)
    return picture[0, ..., :-1].to(values.dtype), cover, depth


@dataclass(frozen=True)
class GpuSplats:
    """Frozen Gaussians on a GPU seen by one camera; `rasterizer.SplatPlan` on the CPU.

    They are projected and sorted anew for every picture: that takes less time than the drawing.
    """

    gaussians: Gaussians
    """M Gaussians, without gradient."""
    camera: Camera
    """Where they are seen from."""
    alpha: Float[Tensor, "H W"]
    """Share of each pixel that is covered."""
    depth: Float[Tensor, "H W"]
    """Expected planar depth [m], +inf where nothing covers the pixel."""

    @staticmethod
    def of(gaussians: Gaussians, camera: Camera) -> GpuSplats:
        """M Gaussians on a GPU in front of a camera."""
        frozen = gaussians.detach()
        nothing = frozen.means.new_zeros(len(frozen), 1)
        _, alpha, depth = splat_on_gpu(frozen, nothing, camera)
        return GpuSplats(frozen, camera, alpha, depth)

    def draw(self, rgb: Float[Tensor, "M 3"]) -> Splatted:
        """The picture with these colours; gradients flow into `rgb`, never into the Gaussians."""
        picture, _, _ = splat_on_gpu(self.gaussians, rgb, self.camera)
        return Splatted(rgb=picture, alpha=self.alpha, depth=self.depth)
