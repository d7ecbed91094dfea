# SPDX-License-Identifier: Apache-2.0
"""The plain twin of the rasteriser: every pixel meets every Gaussian, in torch with autograd.

Slow and easy to read; `rasterizer.py` must give the same picture.
"""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.splat import (
    ALPHA_MAX,
    ALPHA_MIN,
    DILATION_PX2,
    NEAR_M,
    SLOPE_MARGIN,
    Splatted,
)

#: Pixels at a time: a few times so many doubles per Gaussian are in memory.
_CHUNK_PX = 128


def splat_plain(
    gaussians: Gaussians,
    rgb: Float[Tensor, "M 3"],
    camera: Camera,
    rows: tuple[int, int] | None = None,
) -> Splatted:
    """Renders Gaussians in double precision, pixel by Gaussian (see `splat.py` for the formula).

    Args:
        gaussians: M Gaussians; gradients flow into them.
        rgb: Colours in [0, 1], shape [M, 3], or any number of values each.
        camera: Where to look from.
        rows: First and one-past-last row of the picture to render; all of them if not given.

    Returns:
        The picture, in double precision.
    """
    centres, covariances, depths = project_plain(gaussians, camera)
    seen = torch.nonzero(depths > NEAR_M)[:, 0]
    order = seen[torch.argsort(depths[seen], stable=True)]
    centres, inverses, depths = centres[order], torch.linalg.inv(covariances[order]), depths[order]
    opacities = torch.sigmoid(gaussians.logit_opacities.double())[order]
    values = torch.cat([rgb.double()[order], depths[:, None]], dim=1)
    top, bottom = rows or (0, camera.height)
    blended, covers = [], []
    pixels_xy = _pixel_centres(top, bottom, camera.width).to(centres.device)
    for pixels in pixels_xy.split(_CHUNK_PX):
        dx = pixels[:, :1] - centres[:, 0]
        dy = pixels[:, 1:] - centres[:, 1]
        power = (0.5 * inverses[:, 0, 0] * dx + inverses[:, 0, 1] * dy) * dx
        power = power + 0.5 * inverses[:, 1, 1] * dy * dy
        alpha = torch.clamp(opacities * torch.exp(-power), max=ALPHA_MAX)
        alpha = torch.where(alpha < ALPHA_MIN, torch.zeros_like(alpha), alpha)
        light = torch.cumprod(1.0 - alpha, dim=1)
        before = torch.cat([torch.ones_like(light[:, :1]), light[:, :-1]], dim=1)
        weights = alpha * before
        blended.append(weights @ values)
        covers.append(weights.sum(dim=1))
    shape = (bottom - top, camera.width)
    total = torch.cat(blended).reshape(*shape, values.shape[1])
    cover = torch.cat(covers).reshape(shape)
    infinite = torch.full_like(cover, torch.inf)
    depth = torch.where(cover > 0.0, total[..., -1] / cover.clamp_min(1e-12), infinite)
    return Splatted(rgb=total[..., :-1], alpha=cover, depth=depth)


def project_plain(
    gaussians: Gaussians, camera: Camera
) -> tuple[Float[Tensor, "M 2"], Float[Tensor, "M 2 2"], Float[Tensor, "M"]]:
    """Centres [px], dilated covariances [px²] and planar depths [m] in the picture.

    Depths up to the near plane are returned as they are, their projections are meaningless.
    """
    matrix = torch.from_numpy(camera.view_from_world).to(gaussians.means.device)
    view = gaussians.means.double() @ matrix[:3, :3].T + matrix[:3, 3]
    depth = view[:, 2]
    safe = torch.where(depth > NEAR_M, depth, torch.ones_like(depth))
    slope_x, slope_y = view[:, 0] / safe, view[:, 1] / safe
    centres = torch.stack(
        [camera.fl_x * slope_x + camera.cx, camera.fl_y * slope_y + camera.cy], dim=1
    )
    # Where the picture and its margin end; the axis need not be in its middle.
    ends_x, ends_y = (
        [(-SLOPE_MARGIN * size - axis) / focal, (size + SLOPE_MARGIN * size - axis) / focal]
        for size, axis, focal in (
            (camera.width, camera.cx, camera.fl_x),
            (camera.height, camera.cy, camera.fl_y),
        )
    )
    zero = torch.zeros_like(safe)
    row_x = [camera.fl_x / safe, zero, -camera.fl_x * slope_x.clamp(*ends_x) / safe]
    row_y = [zero, camera.fl_y / safe, -camera.fl_y * slope_y.clamp(*ends_y) / safe]
    jacobian = torch.stack([torch.stack(row_x, dim=1), torch.stack(row_y, dim=1)], dim=1)
    double = Gaussians(**{name: value.double() for name, value in gaussians.items()})
    mapped = jacobian @ matrix[:3, :3]
    covariances = mapped @ double.covariances @ mapped.transpose(1, 2)
    dilation = DILATION_PX2 * torch.eye(2, dtype=torch.float64, device=matrix.device)
    return centres, covariances + dilation, depth


def _pixel_centres(top: int, bottom: int, width: int) -> Float[Tensor, "P 2"]:
    rows = torch.arange(top, bottom, dtype=torch.float64) + 0.5
    columns = torch.arange(width, dtype=torch.float64) + 0.5
    row, column = torch.meshgrid(rows, columns, indexing="ij")
    return torch.stack([column.reshape(-1), row.reshape(-1)], dim=1)
