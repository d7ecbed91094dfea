# SPDX-License-Identifier: Apache-2.0
"""Matched-filter maps of one frame over the whole grid, one per ordered device pair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32

from rfgs_core.evaluate.grid import Grid
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Maps whose range cells are wider than this are computed on every second voxel only [m].
COARSE_RANGE_M = 0.15
#: Power of each device pair, (pair, N), at points (N, 3) [m].
PowerMap = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class ThinnedMaps:
    """Matched-filter power per device pair on a thinned grid."""

    power: Float[np.ndarray, "pair i j k"]
    """Power at the thinned voxel centres."""
    pairs: list[tuple[int, int]]
    """Transmitting and receiving device of each map."""
    grid: Grid
    """The full grid."""
    stride: int
    """Every how many voxels the map was computed."""

    @property
    def different(self) -> Bool[np.ndarray, "pair"]:
        """Which pairs are of two different devices."""
        return np.array([a != b for a, b in self.pairs], dtype=bool)

    def on_grid(self, thinned: Float[np.ndarray, "i j k"]) -> Float32[np.ndarray, "x y z"]:
        """Interpolates a combination of maps linearly to every voxel."""
        if self.stride == 1:
            return thinned.astype(np.float32)
        full = thinned
        for axis in range(3):
            weights = _interpolation(
                self.grid.axis_m(axis, self.stride), self.grid.axis_m(axis)
            ).astype(thinned.dtype)
            full = np.moveaxis(np.tensordot(weights, full, axes=(1, axis)), 0, axis)
        return full.astype(np.float32)


def _interpolation(
    known: Float[np.ndarray, "n"], wanted: Float[np.ndarray, "m"]
) -> Float[np.ndarray, "m n"]:
    """Matrix of linear interpolation from `known` to `wanted` coordinates."""
    return np.stack([np.interp(wanted, known, row) for row in np.eye(len(known))], axis=1)


def thinned_maps(
    power_map: PowerMap,
    pairs: list[tuple[int, int]],
    freq_hz: Float[np.ndarray, "subcarrier"],
    grid: Grid,
) -> ThinnedMaps:
    """Power of every device pair with a visible link.

    Args:
        power_map: Gives the power of each of `pairs` at points.
        pairs: Transmitting and receiving device of each row.
        freq_hz: Subcarrier frequencies [Hz].
        grid: Where to evaluate.
    """
    bandwidth_hz = float(freq_hz[-1] - freq_hz[0])
    stride = 2 if SPEED_OF_LIGHT / (2.0 * bandwidth_hz) > COARSE_RANGE_M else 1
    axes = [grid.axis_m(axis, stride) for axis in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    power = power_map(points.reshape(-1, 3))
    return ThinnedMaps(power.reshape(len(pairs), *points.shape[:3]), pairs, grid, stride)
