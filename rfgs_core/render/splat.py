# SPDX-License-Identifier: Apache-2.0
"""What both rasterisers agree on: the constants and the picture they return.

A Gaussian with view-space centre t and covariance V projects (EWA splatting; Zwicker et al. 2001,
used by Kerbl et al. 2023 and by section 3.7 of the paper) to centre (f_x t_x/t_z + c_x,
f_y t_y/t_z + c_y) and covariance Σ' = J V Jᵀ + 0.3 I [px²]. At a pixel centre it has
a = min(0.99, o · exp(−½ dᵀ Σ'⁻¹ d)), nothing below 1/255, and colours add up front to back:
C = Σ_i c_i a_i Π_{j<i} (1 − a_j).

Opacities come from radio power, not from pictures: weakly reflecting parts are faint, and those
below 1/255 are not drawn at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from jaxtyping import Float
from torch import Tensor

#: Gaussians nearer than this are not drawn: the linear projection fails there [m].
NEAR_M = 0.2

#: Added to the projected variance so that small Gaussians do not fall between pixels [px²].
DILATION_PX2 = 0.3

#: Contributions below are dropped: one step of an 8-bit picture.
ALPHA_MIN = 1.0 / 255.0

#: Largest contribution of one Gaussian, which keeps the light behind it visible.
ALPHA_MAX = 0.99

#: Edge of a tile of a picture [px] (paper section 3.7).
TILE_PX = 16

#: Slopes are clamped in the Jacobian where they leave the picture by this share of its side.
SLOPE_MARGIN = 0.15


@dataclass(frozen=True)
class Splatted:
    """A rendered picture, without background."""

    rgb: Float[Tensor, "H W 3"]
    """Colours multiplied by their weights; add `(1 − alpha) · background`."""
    alpha: Float[Tensor, "H W"]
    """Share of each pixel that is covered, in [0, 1]."""
    depth: Float[Tensor, "H W"]
    """Expected planar depth of what covers the pixel [m], +inf where nothing does."""

    def over(self, background: Float[Tensor, "H W 3"] | float) -> Float[Tensor, "H W 3"]:
        """The picture on top of a background."""
        return self.rgb + (1.0 - self.alpha)[..., None] * background


class FrozenSplats(Protocol):
    """Frozen Gaussians seen by one camera: draws any colours, as often as wanted."""

    @property
    def alpha(self) -> Float[Tensor, "H W"]:
        """Share of each pixel that is covered."""
        ...

    @property
    def depth(self) -> Float[Tensor, "H W"]:
        """Expected planar depth [m], +inf where nothing covers the pixel."""
        ...

    def draw(self, rgb: Float[Tensor, "M 3"]) -> Splatted:
        """The picture with these colours; gradients flow into `rgb`, never into the Gaussians."""
        ...
