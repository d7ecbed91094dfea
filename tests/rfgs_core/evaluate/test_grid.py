# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math

import numpy as np
import pytest

from rfgs_core.evaluate.grid import Grid, splat_gaussians

GRID = Grid.over(np.array([[0.0, 0.0, 0.0], [2.0, 1.6, 1.2]]))


def box_mass(grid: Grid, mean: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Exact mass of an axis-aligned Gaussian in each voxel."""
    parts = []
    for axis in range(3):
        edges = grid.origin_m[axis] + np.arange(grid.shape[axis] + 1) * grid.voxel_m
        at = (edges - mean[axis]) / (sigma[axis] * math.sqrt(2))
        parts.append(np.diff([0.5 * (1 + math.erf(value)) for value in at]))
    return np.einsum("i,j,k->ijk", *parts)


def test_grid_covers_the_bounds_with_voxels_of_4_cm() -> None:
    assert GRID.shape == (50, 40, 30)
    np.testing.assert_allclose(GRID.centres()[0], 0.02)
    np.testing.assert_allclose(GRID.centres()[-1], [1.98, 1.58, 1.18])
    np.testing.assert_allclose(GRID.centres(np.array([30 * 40]))[0], [0.06, 0.02, 0.02])


def test_grid_of_uneven_bounds_reaches_beyond_them() -> None:
    grid = Grid.over(np.array([[-0.5, 0.0, 0.0], [0.51, 0.01, 0.04]]))
    assert grid.shape == (26, 1, 1)


def test_thinned_axis_keeps_both_ends() -> None:
    axis = GRID.axis_m(2, 4)
    assert axis[0] == GRID.axis_m(2)[0]
    assert axis[-1] == GRID.axis_m(2)[-1]


@pytest.mark.parametrize("sigma", [[0.03, 0.05, 0.02], [0.06, 0.06, 0.06], [0.1, 0.12, 0.03]])
def test_mass_in_voxels_is_the_integral_of_the_density(sigma: list[float]) -> None:
    mean = np.array([1.013, 0.807, 0.609])
    score = splat_gaussians(GRID, mean[None], np.diag(np.square(sigma))[None], np.ones(1))
    exact = box_mass(GRID, mean, np.array(sigma))
    assert np.abs(score - exact).sum() < 0.03
    assert np.abs(score - exact).max() < 0.03 * exact.max()


def test_voxel_masses_sum_to_the_power_for_any_size_and_rotation() -> None:
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(200, 3, 3)) * rng.uniform(1e-4, 0.05, (200, 1, 1))
    means = rng.uniform([0.9, 0.7, 0.5], [1.1, 0.9, 0.7], (200, 3))
    power = rng.random(200)
    score = splat_gaussians(GRID, means, factor @ factor.transpose(0, 2, 1), power)
    assert score.sum(dtype=np.float64) == pytest.approx(power.sum(), rel=1e-4)


def test_a_point_at_a_voxel_centre_stays_in_its_voxel() -> None:
    mean = GRID.centres(np.array([12345]))
    score = splat_gaussians(GRID, mean, np.zeros((1, 3, 3)), np.array([3.0]))
    assert score.ravel()[12345] > 0.95 * 3.0


def test_mass_outside_the_grid_is_lost() -> None:
    mean = np.array([[0.0, 0.8, 0.6]])
    score = splat_gaussians(GRID, mean, 0.03**2 * np.eye(3)[None], np.ones(1))
    assert score.sum() == pytest.approx(0.5, abs=0.01)


def test_gaussians_without_power_leave_no_trace() -> None:
    assert not splat_gaussians(GRID, np.ones((1, 3)), np.eye(3)[None], np.zeros(1)).any()
    assert not splat_gaussians(GRID, np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0)).any()
