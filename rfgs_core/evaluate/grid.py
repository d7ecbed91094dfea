# SPDX-License-Identifier: Apache-2.0
"""The one voxel grid on which every method is scored, and Gaussians deposited on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Float, Float32, Float64, Int64

#: Edge of a voxel [m].
VOXEL_M = 0.04
#: A Gaussian is cut off at this many standard deviations; what is cut is put back by scaling.
CUTOFF_SIGMA = 3.5


@dataclass(frozen=True)
class Grid:
    """Cubic voxels over the bounds of a scene, axes x, y, z."""

    origin_m: tuple[float, float, float]
    """Lower corner of the first voxel [m]."""
    shape: tuple[int, int, int]
    """Number of voxels along x, y and z."""
    voxel_m: float = VOXEL_M
    """Edge of a voxel [m]."""

    @staticmethod
    def over(bounds_m: Float[np.ndarray, "2 3"]) -> Grid:
        """The grid that covers `bounds_m`, rows minimum and maximum [m].

        Example:
            >>> Grid.over(np.array([[0.0, 0.0, 0.0], [1.0, 0.4, 0.1]])).shape
            (25, 10, 3)
        """
        low, high = np.asarray(bounds_m, dtype=np.float64)
        count = np.maximum(np.ceil((high - low) / VOXEL_M - 1e-9), 1).astype(int)
        return Grid(
            (float(low[0]), float(low[1]), float(low[2])),
            (int(count[0]), int(count[1]), int(count[2])),
        )

    @property
    def size(self) -> int:
        """Number of voxels."""
        return self.shape[0] * self.shape[1] * self.shape[2]

    def axis_m(self, axis: int, stride: int = 1) -> Float64[np.ndarray, "n"]:
        """Coordinates of voxel centres along one axis [m].

        Args:
            axis: 0, 1 or 2.
            stride: Every how many voxels; the last centre is always included, so that
                values on the thinned grid can be interpolated up to the edge.
        """
        index = np.arange(0, self.shape[axis], stride)
        if index[-1] != self.shape[axis] - 1:
            index = np.append(index, self.shape[axis] - 1)
        return self.origin_m[axis] + (index + 0.5) * self.voxel_m

    def centres(self, index: Int64[np.ndarray, "N"] | None = None) -> Float64[np.ndarray, "N 3"]:
        """Voxel centres [m] of flat indices in C order, all of them by default."""
        flat = np.arange(self.size) if index is None else index
        cells = np.stack(np.unravel_index(flat, self.shape), axis=1)
        return np.asarray(self.origin_m) + (cells + 0.5) * self.voxel_m


@numba.njit(cache=True)
def _deposit(score, origin, voxel, means, precisions, reach_m, power, cutoff):
    """Adds every Gaussian's mass, normalised over the voxels of its own box, to the grid."""
    for m in range(means.shape[0]):
        low = np.floor((means[m] - reach_m[m] - origin) / voxel).astype(np.int64)
        high = np.floor((means[m] + reach_m[m] - origin) / voxel).astype(np.int64) + 1
        weight = np.zeros((high[0] - low[0], high[1] - low[1], high[2] - low[2]))
        total = 0.0
        a = precisions[m]
        for i in range(weight.shape[0]):
            x = origin[0] + (low[0] + i + 0.5) * voxel - means[m, 0]
            for j in range(weight.shape[1]):
                y = origin[1] + (low[1] + j + 0.5) * voxel - means[m, 1]
                for k in range(weight.shape[2]):
                    z = origin[2] + (low[2] + k + 0.5) * voxel - means[m, 2]
                    q = a[0, 0] * x * x + a[1, 1] * y * y + a[2, 2] * z * z
                    q += 2.0 * (a[0, 1] * x * y + a[0, 2] * x * z + a[1, 2] * y * z)
                    if q < cutoff:
                        weight[i, j, k] = math.exp(-0.5 * q)
                        total += weight[i, j, k]
        start = np.maximum(low, 0)
        for i in range(start[0], min(high[0], score.shape[0])):
            for j in range(start[1], min(high[1], score.shape[1])):
                for k in range(start[2], min(high[2], score.shape[2])):
                    part = weight[i - low[0], j - low[1], k - low[2]]
                    score[i, j, k] += power[m] * part / total


def splat_gaussians(
    grid: Grid,
    means: Float[np.ndarray, "M 3"],
    covariances: Float[np.ndarray, "M 3 3"],
    power: Float[np.ndarray, "M"],
) -> Float32[np.ndarray, "x y z"]:
    """Score of every voxel: reflected power times the Gaussian's mass in the voxel, summed.

    A voxel's mass is the density averaged over its box. The box is taken as a normal
    distribution of the same variance, voxel²/12, which is added to the covariance; the sum
    over the voxels is then scaled to the power. Mass outside the grid is lost.

    Args:
        grid: Where to score.
        means: Centres [m].
        covariances: Covariance matrices [m²].
        power: Reflected power of each Gaussian, non-negative, any unit.

    Returns:
        Score in the unit of `power`.
    """
    used = np.asarray(power) > 0.0
    smoothed = np.asarray(covariances, dtype=np.float64)[used]
    smoothed = smoothed + np.eye(3) * grid.voxel_m**2 / 12.0
    # A whole voxel is added so that a point-like Gaussian always has a centre within reach.
    reach_m = CUTOFF_SIGMA * np.sqrt(np.diagonal(smoothed, axis1=1, axis2=2)) + grid.voxel_m
    score = np.zeros(grid.shape, dtype=np.float64)
    _deposit(
        score,
        np.asarray(grid.origin_m, dtype=np.float64),
        grid.voxel_m,
        np.ascontiguousarray(np.asarray(means, dtype=np.float64)[used]),
        np.linalg.inv(smoothed),
        reach_m,
        np.asarray(power, dtype=np.float64)[used],
        CUTOFF_SIGMA**2,
    )
    return score.astype(np.float32)
