# SPDX-License-Identifier: Apache-2.0
"""Volume rendering: where rays through a density end, and which places of them are worth asking."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from rfgs_core.neural.fields import NeuralField

#: Rays begin this far from their antenna [m].
NEAREST_M = 0.2
#: Cells per side of the grid that says what is empty, and how fast it forgets.
OCCUPANCY_SIDE, OCCUPANCY_DECAY = 32, 0.95
#: Chance of ending within a cell below which the cell counts as empty.
LEAST_OPACITY = 0.01


def ending_weights(
    log_density: Float[Tensor, "ray sample"], length_m: Float[Tensor, "ray sample"]
) -> Float[Tensor, "ray sample"]:
    """Share of each ray that ends within each of its stretches.

    w_j = exp(−Σ_{i<j} σ_i δ_i) (1 − exp(−σ_j δ_j)) (Max, IEEE TVCG 1(2), 1995).

    Args:
        log_density: Logarithm of the density σ per metre.
        length_m: Lengths δ of the stretches, from the antenna outwards [m].
    """
    depth = torch.exp(log_density) * length_m
    passed = torch.exp(-(torch.cumsum(depth, dim=1) - depth))
    return passed * -torch.expm1(-depth)


@dataclass(frozen=True)
class Rays:
    """Rays from antennas through sample points, cut into stretches with one place in each."""

    xyz: Float[Tensor, "ray sample 3"]
    """Places [m]; one of each ray is its sample point."""
    length_m: Float[Tensor, "ray sample"]
    """Lengths of the stretches [m]."""
    extent_m: Float[Tensor, "ray sample 3"]
    """Standard deviations of the cone within each stretch, along the axes [m]."""
    own: Float[Tensor, "ray sample"]
    """One in the stretch of the sample point, zero elsewhere."""

    @staticmethod
    def through(
        points: Float[Tensor, "ray 3"],
        origins: Float[Tensor, "ray 3"],
        bounds_m: Float[Tensor, "2 3"],
        samples: int,
        radius_m: float,
        generator: torch.Generator,
    ) -> Rays:
        """Stratified places from near each antenna to the scene's bounds behind the point.

        Args:
            points: Sample points within the bounds [m].
            origins: Antenna of each ray [m].
            bounds_m: Scene bounds [m].
            samples: Stretches per ray.
            radius_m: Standard deviation of a cone at its sample point, across the ray [m].
            generator: Draws the places.
        """
        way = points - origins
        distance = torch.linalg.norm(way, dim=1, keepdim=True).clamp(min=NEAREST_M + 1e-3)
        direction = way / distance
        step = torch.where(direction.abs() < 1e-6, torch.full_like(direction, 1e-6), direction)
        exits = torch.maximum((bounds_m[0] - origins) / step, (bounds_m[1] - origins) / step)
        far = torch.maximum(exits.min(dim=1, keepdim=True).values, distance + 1e-3)
        length = (far - NEAREST_M) / samples
        begins = NEAREST_M + length * torch.arange(samples)
        along = begins + length * torch.rand(len(points), samples, generator=generator)
        index = ((distance - NEAREST_M) / length).long().clamp(0, samples - 1)
        along = along.scatter(1, index, distance)
        own = torch.zeros_like(along).scatter(1, index, 1.0)
        xyz = origins[:, None] + along[..., None] * direction[:, None]
        across = radius_m * along / distance
        # A stretch is even along the ray; the cone's cross-section grows with the distance.
        square = direction[:, None] ** 2 * (length**2 / 12.0)[..., None]
        square = square + (1.0 - direction[:, None] ** 2) * (across**2)[..., None]
        return Rays(xyz, length.expand_as(along), square.sqrt(), own)


class Occupancy:
    """What a hash-grid field need not be asked about, as it was empty lately (Müller et al.)."""

    def __init__(self, bounds_m: Float[Tensor, "2 3"], generator: torch.Generator) -> None:
        self.low, self.high = bounds_m
        self.generator = generator
        self.opacity = torch.ones(OCCUPANCY_SIDE**3)

    def _cell(self, xyz: Float[Tensor, "N 3"]) -> Tensor:
        unit = (xyz - self.low) / (self.high - self.low)
        x, y, z = (unit * OCCUPANCY_SIDE).long().clamp(0, OCCUPANCY_SIDE - 1).unbind(1)
        return (x * OCCUPANCY_SIDE + y) * OCCUPANCY_SIDE + z

    def update(self, field: NeuralField) -> None:
        """Looks at one random place of each cell; what was dense is forgotten slowly."""
        cells = torch.arange(OCCUPANCY_SIDE)
        corner = torch.stack(torch.meshgrid(cells, cells, cells, indexing="ij"), dim=-1)
        corner = corner.reshape(-1, 3) + torch.rand(OCCUPANCY_SIDE**3, 3, generator=self.generator)
        size = (self.high - self.low) / OCCUPANCY_SIDE
        with torch.no_grad():
            log_density = field(self.low + corner * size).log_density
        now = -torch.expm1(-torch.exp(log_density) * float(size.max()))
        self.opacity = torch.maximum(self.opacity * OCCUPANCY_DECAY, now)

    def occupied(self, xyz: Float[Tensor, "N 3"]) -> Bool[Tensor, "N"]:
        """Which places lie in cells that are not known to be empty."""
        return self.opacity[self._cell(xyz)] > LEAST_OPACITY
