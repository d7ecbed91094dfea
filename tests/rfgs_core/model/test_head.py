# SPDX-License-Identifier: Apache-2.0
"""The head reads exactly what was written into the features."""

from __future__ import annotations

import math

import pytest
import torch

from rfgs_core.model.head import RadioHead

WAVELENGTH_M, SCALE_M = 0.0517, 0.04
#: k · 2 · s · ρ = 0.5.
START_RHO = 0.5 / (2 * math.pi / WAVELENGTH_M * 2 * SCALE_M)


@pytest.fixture
def head() -> RadioHead:
    return RadioHead.create(3, WAVELENGTH_M, SCALE_M, 0.02)


@pytest.fixture
def features() -> torch.Tensor:
    return torch.randn(50, 32, generator=torch.Generator().manual_seed(0))


def test_directions_are_orthonormal_and_come_from_the_seed(head: RadioHead) -> None:
    assert head.directions.shape == (3, 32)
    torch.testing.assert_close(head.directions @ head.directions.T, torch.eye(3))
    again = RadioHead.create(3, WAVELENGTH_M, SCALE_M, 0.02)
    assert torch.equal(again.directions, head.directions)
    other = RadioHead.create(4, WAVELENGTH_M, SCALE_M, 0.02)
    assert not torch.allclose(other.directions, head.directions)


def test_written_reflectivity_is_read_back(head: RadioHead, features: torch.Tensor) -> None:
    gamma = torch.randn(50, dtype=torch.complex64, generator=torch.Generator().manual_seed(1))
    gamma = gamma * 0.03
    written = head.with_gamma(features, gamma)
    torch.testing.assert_close(head.gamma(written), gamma, rtol=1e-5, atol=1e-8)
    torch.testing.assert_close(head.rho(written), head.rho(features))


def test_writing_changes_as_little_as_possible(head: RadioHead, features: torch.Tensor) -> None:
    gamma = torch.full((50,), 0.01 + 0.02j, dtype=torch.complex64)
    change = head.with_gamma(features, gamma) - features
    # The smallest change lies in the span of the two directions that are read.
    inside = change @ head.directions[:2].T @ head.directions[:2]
    torch.testing.assert_close(change, inside, rtol=0, atol=1e-5)
    have = head.gamma(features)
    expected = (gamma - have).abs() / head.gamma_scale_m
    torch.testing.assert_close(torch.linalg.norm(change, dim=1), expected, rtol=1e-4, atol=1e-5)


def test_features_without_readings_decode_to_nothing(
    head: RadioHead, features: torch.Tensor
) -> None:
    silent = head.without_readings(features)
    assert head.gamma(silent).abs().max() < 1e-5 * head.gamma_scale_m
    torch.testing.assert_close(head.rho(silent), torch.full((50,), START_RHO), rtol=1e-5, atol=1e-6)
    # Everything else stays, and doing it twice is doing it once.
    rest = torch.eye(32) - head.directions.T @ head.directions
    torch.testing.assert_close(silent, features @ rest, rtol=0, atol=1e-5)
    torch.testing.assert_close(head.without_readings(silent), silent, rtol=0, atol=1e-5)


def test_rho_starts_where_gaussians_still_reflect(head: RadioHead) -> None:
    rho = head.rho(torch.zeros(1, 32)).item()
    assert rho == pytest.approx(START_RHO, rel=1e-5)
    # Tiny Gaussians at low frequency: never above one.
    assert RadioHead.create(0, 3.0, 0.001, 1.0).rho(torch.zeros(1, 32)).item() < 1.0


def test_the_radio_sees_shrunken_gaussians_with_their_normals(head, make_gaussians) -> None:
    gaussians = make_gaussians(7)
    seen = head.radio_gaussians(gaussians)
    rho = head.rho(gaussians.features)
    torch.testing.assert_close(seen.scales_rf, seen.scales * rho[:, None])
    torch.testing.assert_close(seen.gamma[:, 0], head.gamma(gaussians.features))
    assert seen.normals is not None
    z = gaussians.rotations @ torch.tensor([0.0, 0.0, 1.0])
    torch.testing.assert_close(seen.normals, z)
