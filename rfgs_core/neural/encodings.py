# SPDX-License-Identifier: Apache-2.0
"""What a network reads of a place: sines, sines averaged over a volume, or a hash table's rows."""

from __future__ import annotations

import math

import torch
from jaxtyping import Float, Int64
from torch import Tensor, nn

#: Factors of the spatial hash (Müller et al., ACM Trans. Graph. 41(4), 2022, eq. 4).
_PRIMES = (1, 2_654_435_761, 805_459_861)


def positional(x: Float[Tensor, "N 3"], octaves: int) -> Float[Tensor, "N out"]:
    """Sines and cosines of 2^l π x, and x itself (Mildenhall et al., ECCV 2020, eq. 4).

    Args:
        x: Places in [−1, 1].
        octaves: Number of frequencies; zero leaves the place as it is.
    """
    return integrated(x, torch.zeros_like(x), octaves)


def integrated(
    mean: Float[Tensor, "N 3"], variance: Float[Tensor, "N 3"], octaves: int
) -> Float[Tensor, "N out"]:
    """`positional` averaged over a normal distribution (Barron et al., ICCV 2021, eq. 14).

    E[sin(kx)] = sin(kμ) exp(−k²σ²/2): what is finer than the volume fades.

    Args:
        mean: Centres in [−1, 1].
        variance: Variances along the axes, in the units of `mean` squared.
        octaves: Number of frequencies.
    """
    k = math.pi * 2.0 ** torch.arange(octaves, device=mean.device)
    phase = (mean[:, None, :] * k[:, None]).flatten(1)
    fade = torch.exp(-0.5 * (variance[:, None, :] * k[:, None] ** 2).flatten(1))
    return torch.cat([mean, fade * phase.sin(), fade * phase.cos()], dim=1)


class HashGrid(nn.Module):
    """Trilinear readings of grids from coarse to fine, whose corners share one table per level.

    Levels grow geometrically (Müller et al., eq. 2, 3); corners of levels that fit into the table
    have a row of their own, those of others share rows by a spatial hash.
    """

    def __init__(
        self,
        levels: int,
        coarsest: int,
        finest: int,
        table_size: int,
        width: int,
        generator: torch.Generator,
    ) -> None:
        """Levels of `coarsest` to `finest` cells per side and `width` values per corner."""
        super().__init__()
        growth = (finest / coarsest) ** (1.0 / max(levels - 1, 1))
        self.sides = [round(coarsest * growth**level) for level in range(levels)]
        self.table_size = table_size
        tables = torch.rand(levels, table_size, width, generator=generator)
        self.tables = nn.Parameter(2e-4 * tables - 1e-4)

    @property
    def out_features(self) -> int:
        """Length of what is read."""
        return self.tables.shape[0] * self.tables.shape[2]

    def forward(self, x: Float[Tensor, "N 3"]) -> Float[Tensor, "N out"]:
        """Readings at places in [−1, 1]; those outside read the border."""
        unit = (0.5 * (x + 1.0)).clamp(0.0, 1.0)
        # Taken apart once: the gradient of every reading is then of its own level's table alone.
        read = [self._level(level, table, unit) for level, table in enumerate(self.tables.unbind())]
        return torch.cat(read, dim=1)

    def _level(
        self, level: int, table: Float[Tensor, "rows width"], unit: Float[Tensor, "N 3"]
    ) -> Float[Tensor, "N width"]:
        cell = unit * self.sides[level]
        low = cell.floor().clamp(max=self.sides[level] - 1)
        part, low = cell - low, low.long()
        total = cell.new_zeros(len(cell), table.shape[1])
        for corner in range(8):
            step = torch.tensor([corner >> axis & 1 for axis in range(3)], device=cell.device)
            weight = torch.where(step.bool(), part, 1.0 - part).prod(dim=1, keepdim=True)
            total = total + weight * table[self._rows(level, low + step)]
        return total

    def _rows(self, level: int, corner: Int64[Tensor, "N 3"]) -> Int64[Tensor, "N"]:
        x, y, z = corner.unbind(1)
        side = self.sides[level] + 1
        if side**3 <= self.table_size:
            return (x * side + y) * side + z
        mixed = (x * _PRIMES[0]) ^ (y * _PRIMES[1]) ^ (z * _PRIMES[2])
        return mixed % self.table_size
