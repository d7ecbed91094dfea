# SPDX-License-Identifier: Apache-2.0
"""Frames along path legs, shared by both implementations of the shadow.

A Gaussian blob of opacity alpha blocks a path like a soft screen across it. With rho the
position in the plane across the path, rho_0 the blob's centre there, S its projected covariance,
d_1, d_2 its distances from the ends of the unfolded path and

    kappa = lambda / (2 pi) d_1 d_2 / (d_1 + d_2)   [m^2],

the Fresnel integral over the screen (Kirchhoff, as for a knife edge) is closed:

    g = j / (2 pi kappa) integral exp(-(rho - rho_0)^T S^-1 (rho - rho_0) / 2)
                                  exp(-j |rho|^2 / (2 kappa)) d^2 rho
      = sqrt(det S / det C) exp(-rho_0^T C^-1 rho_0 / 2),      C = S - j kappa I.

The blob is widened by the Fresnel zone, kappa. For kappa -> 0, g is the blob itself; for a blob
much smaller than the zone it is j sqrt(det S) / kappa exp(-j |rho_0|^2 / (2 kappa)).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from jaxtyping import Float64
from torch import Tensor

from rfgs_core.propagation.geometry import EnvironmentPaths

#: Over this length at both ends of a leg its shadow fades in, so that gradients exist [m].
EDGE_M = 0.05


@dataclass(frozen=True)
class LegFrames:
    """Right-handed frames of path legs: `along` the path, `first` and `second` across."""

    origin: Float64[Tensor, "path 3"]
    """Start of each leg [m]."""
    along: Float64[Tensor, "path 3"]
    """Unit vector from start to end."""
    first: Float64[Tensor, "path 3"]
    """Unit vector across the path."""
    second: Float64[Tensor, "path 3"]
    """Unit vector across the path and `first`."""
    length: Float64[Tensor, "path"]
    """Length of the leg [m]."""
    before: Float64[Tensor, "path"]
    """Length of the unfolded path before the leg [m]."""
    behind: Float64[Tensor, "path"]
    """Length of the unfolded path behind the leg [m]."""

    def table(self) -> Float64[Tensor, "path 15"]:
        """All fields side by side, in their order."""
        scalars = torch.stack([self.length, self.before, self.behind], dim=1)
        return torch.cat([self.origin, self.along, self.first, self.second, scalars], dim=1)


def leg_frames(paths: EnvironmentPaths) -> LegFrames:
    """Frames of the legs on which people may stand."""
    origin = paths.a_xyz.detach().to(torch.float64)
    leg = paths.b_xyz.detach().to(torch.float64) - origin
    length = torch.linalg.vector_norm(leg, dim=1)
    # A leg of no length shadows nothing; any direction will do.
    along = torch.where(length[:, None] > 0, leg / length[:, None].clamp(min=1e-300), 0.0)
    along[length == 0, 0] = 1.0
    # The coordinate axis most across the leg: never parallel to it.
    axis = torch.nn.functional.one_hot(along.abs().argmin(dim=1), 3).to(torch.float64)
    first = torch.nn.functional.normalize(torch.linalg.cross(along, axis), dim=1)
    return LegFrames(
        origin=origin,
        along=along,
        first=first,
        second=torch.linalg.cross(along, first),
        length=length,
        before=paths.extra_a_m.detach().to(torch.float64),
        behind=paths.extra_b_m.detach().to(torch.float64),
    )
