# SPDX-License-Identifier: Apache-2.0
"""The first Gaussians: how they face, how much they cover."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from rfgs_core.gaussians.model import rotation_matrices
from rfgs_core.model.first_gaussians import gaussians_at, quats_from_normals


def test_local_z_turns_into_the_normal() -> None:
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((50, 3))
    special = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1e-4, 0, -1], [0, 1e-7, -1]]
    normals = np.concatenate([normals, special])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    quats = quats_from_normals(normals)
    torch.testing.assert_close(torch.linalg.norm(quats, dim=1), torch.ones(56))
    matrices = rotation_matrices(quats)
    np.testing.assert_allclose(matrices[:, :, 2], normals, atol=1e-6)
    np.testing.assert_allclose(torch.linalg.det(matrices), np.ones(56), atol=1e-5)


@pytest.mark.parametrize("count", [300, 6000])
def test_new_gaussians_cover_a_silhouette_one_and_a_half_times(count: int) -> None:
    points = np.random.default_rng(0).uniform(0, 1, (count, 3))
    normals = np.tile([[0.0, 1.0, 0.0]], (count, 1))
    gaussians = gaussians_at(points, normals)
    # A blob of peak α hides 2π s² α of what lies behind it.
    hidden = (gaussians.opacities * 2 * math.pi * 0.04 * 0.04).sum().item()
    assert hidden == pytest.approx(1.5 * 0.75, rel=1e-4)
    np.testing.assert_allclose(gaussians.means, points, atol=1e-7)
    np.testing.assert_allclose(gaussians.scales[0], [0.04, 0.04, 0.025], rtol=1e-6)
    np.testing.assert_allclose(gaussians.rotations[:, :, 2], normals, atol=1e-6)
    assert (gaussians.features == 0).all()


def test_few_gaussians_stay_half_transparent() -> None:
    gaussians = gaussians_at(np.zeros((3, 3)), np.tile([[0.0, 0.0, 1.0]], (3, 1)))
    torch.testing.assert_close(gaussians.opacities, torch.full((3,), 0.5))
