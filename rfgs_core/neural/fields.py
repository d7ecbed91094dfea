# SPDX-License-Identifier: Apache-2.0
"""Density and 32 features at any place of a scene, as a network gives them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Float32, Float64
from torch import Tensor, nn

from rfgs_core.gaussians import FEATURE_DIM
from rfgs_core.neural.encodings import HashGrid, integrated, positional
from rfgs_core.neural.settings import FieldSettings

#: Levels, coarsest cells per side, rows and values per row of a hash table.
LEVELS, COARSEST, TABLE_SIZE, TABLE_WIDTH = 8, 4, 1 << 15, 2
#: Logarithms of densities are cut off here, which keeps exponentials finite.
MOST_LOG_DENSITY = 12.0
#: Places that a network reads at a time when it is asked about a whole scene.
_AT_ONCE = 1 << 16

#: Logarithm of a factor of the density at places [m]; −∞ where nothing can be.
LogPrior = Callable[[Float64[np.ndarray, "N 3"]], Float64[np.ndarray, "N"]]


class FieldValues(NamedTuple):
    """What a field says at some places."""

    log_density: Float[Tensor, "N"]
    """Logarithm of the density per metre."""
    features: Float[Tensor, "N 32"]
    """Radio features."""


class NeuralField(nn.Module):
    """A network of `settings.kind` over the bounds of a scene."""

    def __init__(self, settings: FieldSettings, bounds_m: Float64[np.ndarray, "2 3"]) -> None:
        """A field with random weights, which depend on the seed alone."""
        super().__init__()
        generator = torch.Generator().manual_seed(settings.seed % (1 << 63))
        low, high = torch.from_numpy(np.asarray(bounds_m)).float()
        self.settings = settings
        #: Half of the longest side [m]; all axes share it, so that a sine is as long along each.
        self.half_m = float((high - low).max()) / 2.0
        #: Middle of the scene [m].
        self.centre_m = (low + high) / 2.0
        layers, size = settings.layers, 3 * (1 + 2 * self._octaves)
        self.table = None
        if settings.kind == "ngp":
            finest = max(round(2.0 * self.half_m / settings.finest_m), COARSEST)
            self.table = HashGrid(LEVELS, COARSEST, finest, TABLE_SIZE, TABLE_WIDTH, generator)
            layers, size = layers - 1, self.table.out_features
        self.network = perceptron(size, settings.width, layers, 1 + FEATURE_DIM, generator)

    @property
    def _octaves(self) -> int:
        return 0 if self.settings.kind == "plain" else self.settings.octaves

    def forward(
        self, xyz: Float[Tensor, "N 3"], extent_m: Float[Tensor, "N 3"] | None = None
    ) -> FieldValues:
        """Density and features.

        Args:
            xyz: Places [m].
            extent_m: Standard deviations of the volume that is asked about, along the axes [m];
                only `mip` reads them, and takes None for a point.
        """
        x = (xyz - self.centre_m) / self.half_m
        if self.table is not None:
            read = self.table(x)
        elif self.settings.kind == "mip" and extent_m is not None:
            read = integrated(x, (extent_m / self.half_m) ** 2, self._octaves)
        else:
            read = positional(x, self._octaves)
        out = self.network(read)
        # Bounded smoothly: a hard limit would have no gradient back.
        log_density = MOST_LOG_DENSITY * torch.tanh(out[:, 0] / MOST_LOG_DENSITY)
        return FieldValues(log_density, out[:, 1:])

    def everywhere(
        self, points: Float64[np.ndarray, "N 3"], extent_m: float
    ) -> tuple[Float32[np.ndarray, "N"], Float32[np.ndarray, "N 32"]]:
        """Log density and features at many places, as volumes of a standard deviation [m]."""
        density, features = [], []
        with torch.no_grad():
            for part in torch.from_numpy(points).float().split(_AT_ONCE):
                values = self(part, torch.full_like(part, extent_m))
                density.append(values.log_density)
                features.append(values.features)
        return torch.cat(density).numpy(), torch.cat(features).numpy()


def perceptron(
    size: int, width: int, layers: int, out: int, generator: torch.Generator
) -> nn.Sequential:
    """Hidden layers with ReLU, He-initialised from the generator, and a linear last one."""
    sizes = [size, *[width] * layers, out]
    parts: list[nn.Module] = []
    for index, (into, onto) in enumerate(pairwise(sizes)):
        layer = nn.Linear(into, onto)
        gain = 2.0 if index < layers else 1.0
        weight = torch.randn(onto, into, generator=generator) * (gain / into) ** 0.5
        layer.weight.data.copy_(weight)
        layer.bias.data.zero_()
        parts += [layer] if index == layers else [layer, nn.ReLU()]
    return nn.Sequential(*parts)
