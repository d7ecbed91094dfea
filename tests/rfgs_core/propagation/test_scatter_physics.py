# SPDX-License-Identifier: Apache-2.0
"""Scattering of Gaussians against closed forms."""

from __future__ import annotations

import math

import pytest
import torch

from rfgs_core.propagation import Links, Subcarriers, scatter
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BACKENDS = ["numba", "torch"]
IDENTITY = torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64)


def tensor(*rows: object) -> torch.Tensor:
    return torch.tensor(rows, dtype=torch.float64)


def point(xyz: torch.Tensor, gamma: torch.Tensor) -> tuple[torch.Tensor, ...]:
    """Gaussians far smaller than a wavelength."""
    count = len(xyz)
    scales = torch.full((count, 3), 1e-7, dtype=torch.float64)
    return xyz, IDENTITY.expand(count, 4), scales, gamma


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_point_obeys_the_radar_equation(backend: str) -> None:
    links = Links(tensor([0.0, 0.0, 0.0]), tensor([4.0, 0.0, 0.0]))
    subcarriers = Subcarriers(5.72e9, 2.5e6, 64)
    section_m2 = 0.3
    gamma = torch.full((1, 1), math.sqrt(section_m2), dtype=torch.complex128)
    csi = scatter(*point(tensor([1.0, 2.0, 0.5]), gamma), links, subcarriers, backend=backend)

    d_t, d_r = math.sqrt(1 + 4 + 0.25), math.sqrt(9 + 4 + 0.25)
    wavelength_m = SPEED_OF_LIGHT / subcarriers.freq_hz
    power = wavelength_m**2 * section_m2 / ((4 * math.pi) ** 3 * d_t**2 * d_r**2)
    phase = -2 * math.pi * subcarriers.freq_hz * (d_t + d_r) / SPEED_OF_LIGHT
    expected = torch.polar(power.sqrt(), phase)[None]
    torch.testing.assert_close(csi, expected, rtol=1e-9, atol=0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_gaussian_is_a_cloud_of_points(backend: str) -> None:
    """The far field of many points drawn on a grid under the Gaussian's density."""
    wavelength_m = 0.05
    scales = torch.tensor([[0.006, 0.010, 0.003]], dtype=torch.float64)
    # 30 degrees about z, not normalised.
    quat = 2.0 * tensor([math.cos(math.pi / 12), 0.0, 0.0, math.sin(math.pi / 12)])
    centre = tensor([0.0, 0.0, 0.0])
    # Far away: plane waves over the cloud, the assumption of the formula.
    links = Links(tensor([-900.0, 200.0, 50.0]), tensor([-700.0, -300.0, 120.0]))
    subcarriers = Subcarriers(SPEED_OF_LIGHT / wavelength_m, 50e6, 3)
    one = torch.ones(1, 1, dtype=torch.complex128)
    csi = scatter(centre, quat, scales, one, links, subcarriers, backend=backend)

    axis = torch.linspace(-5, 5, 21, dtype=torch.float64)
    grid = torch.cartesian_prod(axis, axis, axis)
    weight = torch.exp(-0.5 * grid.square().sum(1))
    weight = weight / weight.sum()
    turn = torch.tensor(
        [[math.sqrt(0.75), -0.5, 0.0], [0.5, math.sqrt(0.75), 0.0], [0.0, 0.0, 1.0]],
        dtype=torch.float64,
    )
    points = (grid * scales) @ turn.T
    weights = torch.complex(weight, torch.zeros_like(weight))[:, None]
    summed = scatter(*point(points, weights), links, subcarriers, backend="torch")
    assert abs(csi[0, 0]) < 0.9 * abs(scatter(*point(centre, one), links, subcarriers)[0, 0])
    torch.testing.assert_close(csi, summed, rtol=1e-4, atol=0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_flat_gaussian_is_a_mirror(backend: str) -> None:
    """In the specular direction nothing is lost, beside it what an aperture of 10 cm loses."""
    scales = torch.tensor([[0.1, 0.1, 1e-6]], dtype=torch.float64)
    beside = 5 * math.sin(math.radians(20)), 5 * math.cos(math.radians(20))
    links = Links(
        tensor([-3.0, 0.0, 4.0], [-3.0, 0.0, 4.0]),
        tensor([3.0, 0.0, 4.0], [beside[0], 0.0, beside[1]]),
    )
    subcarriers = Subcarriers(5.8e9, 0.0, 1)
    gamma = torch.ones(1, 1, dtype=torch.complex128)
    origin = tensor([0.0, 0.0, 0.0])
    csi = scatter(origin, IDENTITY, scales, gamma, links, subcarriers, backend=backend)
    alone = scatter(*point(origin, gamma), links, subcarriers, backend="torch")
    assert abs(csi[0, 0] / alone[0, 0]) == pytest.approx(1.0, abs=1e-6)
    detour = 0.6 - math.sin(math.radians(20))
    lost = math.exp(-0.5 * (2 * math.pi * 5.8e9 / SPEED_OF_LIGHT * 0.1 * detour) ** 2)
    assert abs(csi[1, 0] / alone[1, 0]) == pytest.approx(lost, rel=1e-6)
    assert lost < 0.01


@pytest.mark.parametrize("backend", BACKENDS)
def test_gamma_is_linear_between_knots(backend: str) -> None:
    links = Links(tensor([0.0, 0.0, 0.0]), tensor([4.0, 0.0, 0.0]))
    subcarriers = Subcarriers(3.1e9, 10e6, 91)
    xyz = tensor([1.0, 2.0, 0.5])
    knots = torch.tensor([[1.0, 2.0 + 1.0j, 0.5j, -1.0]], dtype=torch.complex128)
    one = torch.ones(1, 1, dtype=torch.complex128)
    csi = scatter(*point(xyz, knots), links, subcarriers, backend=backend)
    unit = scatter(*point(xyz, one), links, subcarriers, backend="torch")
    ratio = (csi / unit)[0]
    # Knots stand at subcarriers 0, 30, 60 and 90.
    torch.testing.assert_close(ratio[::30], knots[0], rtol=1e-7, atol=1e-9)
    torch.testing.assert_close(ratio[45], knots[0, 1:3].mean(), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("knots", [1, 4])
def test_blocks_of_subcarriers_are_cut_from_the_whole_band(make_cloud, make_links, backend, knots):
    names = ("means", "quats", "scales_rf", "gamma")
    cloud = make_cloud(9, knots=knots, dtype=torch.float64)
    cloud = {name: cloud[name].detach() for name in names}
    links = make_links(4)
    whole = scatter(**cloud, links=links, subcarriers=Subcarriers(5.72e9, 2e6, 90), backend=backend)
    part = Subcarriers(5.72e9, 2e6, 90, blocks=((70, 20), (3, 41)))
    csi = scatter(**cloud, links=links, subcarriers=part, backend=backend)
    expected = torch.cat([whole[:, 70:90], whole[:, 3:44]], dim=1)
    torch.testing.assert_close(csi, expected, rtol=1e-7, atol=1e-14)


@pytest.mark.parametrize("backend", BACKENDS)
def test_normals_and_visibility_weigh_links(backend: str) -> None:
    links = Links(
        tensor([0.0, 0.0, 2.0], [0.0, 0.0, 2.0]),
        tensor([0.0, 1.0, 2.0], [0.0, 1.0, 2.0]),
        torch.tensor([0, 1]),
    )
    subcarriers = Subcarriers(5.8e9, 1e6, 2)
    gaussian = point(tensor([0.0, 0.0, 0.0]), torch.ones(1, 1, dtype=torch.complex128))
    plain = scatter(*gaussian, links, subcarriers, backend=backend)
    weights = tensor([0.25, 3.0])
    weighted = scatter(*gaussian, links, subcarriers, visibility=weights, backend=backend)
    torch.testing.assert_close(weighted, plain * weights.T)

    up = tensor([0.0, 0.0, 1.0])
    seen = scatter(*gaussian, links, subcarriers, normals=up, sharpness=5.0, backend=backend)

    def sigmoid(x: float) -> float:
        return 1 / (1 + math.exp(-x))

    factor = sigmoid(5.0) * sigmoid(5.0 * 2 / math.sqrt(5))
    torch.testing.assert_close(seen, plain * factor)
    hidden = scatter(*gaussian, links, subcarriers, normals=-up, sharpness=5.0, backend=backend)
    assert abs(hidden).max() < 1e-3 * abs(plain).max()
