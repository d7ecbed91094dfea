# SPDX-License-Identifier: Apache-2.0
"""Quantities derived from Gaussians, and selecting and joining them."""

from __future__ import annotations

import math

import pytest
import torch

from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.model import rotation_matrices


@pytest.fixture
def gaussians() -> Gaussians:
    generator = torch.Generator().manual_seed(0)

    def normal(*size: int) -> torch.Tensor:
        return torch.randn(*size, generator=generator)

    return Gaussians(normal(5, 3), normal(5, 4), normal(5, 3), normal(5), normal(5, 32))


def test_a_quarter_turn_about_z() -> None:
    half = math.sqrt(0.5)
    # Twice as long as a unit quaternion: the same rotation.
    matrix = rotation_matrices(torch.tensor([[2 * half, 0.0, 0.0, 2 * half]]))[0]
    expected = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    torch.testing.assert_close(matrix, expected, rtol=0, atol=1e-6)


def test_covariances_have_the_scales_as_axes(gaussians: Gaussians) -> None:
    values = torch.linalg.eigvalsh(gaussians.covariances.double())
    expected = gaussians.scales.double().square().sort(dim=1).values
    torch.testing.assert_close(values, expected, rtol=1e-4, atol=1e-5)
    first = gaussians.rotations[:, :, 0]
    along = torch.einsum("mi,mij,mj->m", first, gaussians.covariances, first)
    torch.testing.assert_close(along, gaussians.scales[:, 0] ** 2, rtol=1e-4, atol=1e-5)


def test_opacities_are_logistic(gaussians: Gaussians) -> None:
    torch.testing.assert_close(torch.logit(gaussians.opacities), gaussians.logit_opacities)


def test_rows_belong_together(gaussians: Gaussians) -> None:
    rows = torch.tensor([False, True, True, False, True])
    chosen, rest = gaussians.select(rows), gaussians.select(~rows)
    joined = Gaussians.join(chosen, rest)
    assert (len(chosen), len(rest), len(joined)) == (3, 2, 5)
    order = [1, 2, 4, 0, 3]
    for name, value in joined.items():
        assert torch.equal(value, getattr(gaussians, name)[order])


def test_nothing_joined_to_something_is_that(gaussians: Gaussians) -> None:
    joined = Gaussians.join(Gaussians.none(), gaussians)
    assert len(Gaussians.none()) == 0
    assert all(torch.equal(value, getattr(gaussians, name)) for name, value in joined.items())


def test_detached_copies_share_nothing(gaussians: Gaussians) -> None:
    gaussians.means.requires_grad_(True)
    copy = gaussians.detach()
    assert not copy.means.requires_grad
    copy.features += 1.0
    assert not torch.equal(copy.features, gaussians.features)
