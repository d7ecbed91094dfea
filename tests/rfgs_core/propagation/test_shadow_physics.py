# SPDX-License-Identifier: Apache-2.0
"""Shadows of Gaussian blobs against closed forms and a numerical Fresnel integral."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from rfgs_core.propagation import (
    EnvironmentPaths,
    Links,
    RadioGaussians,
    Subcarriers,
    environment,
    propagate,
    shadow,
)
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BACKENDS = ["numba", "torch"]
IDENTITY = torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64)


def tensor(*rows: object) -> torch.Tensor:
    return torch.tensor(rows, dtype=torch.float64)


def along_x(
    length_m: float, wavelength_m: float, before_m: float = 0.0, behind_m: float = 0.0
) -> EnvironmentPaths:
    """One path along the x axis."""
    total_m = length_m + before_m + behind_m
    return EnvironmentPaths(
        link=torch.tensor([0]),
        amplitude=torch.tensor([wavelength_m / (4 * math.pi * total_m) + 0j]),
        delay_s=tensor(total_m / SPEED_OF_LIGHT),
        a_xyz=tensor([0.0, 0.0, 0.0]),
        b_xyz=tensor([length_m, 0.0, 0.0]),
        extra_a_m=tensor(before_m),
        extra_b_m=tensor(behind_m),
        wavelength_m=wavelength_m,
    )


def g_of(
    centre: list[float], scales: list[float], paths: EnvironmentPaths, backend: str
) -> complex:
    """The Fresnel integral of one blob: T = 1 - alpha g."""
    through = shadow(
        *(tensor(centre), IDENTITY, tensor(scales), tensor(0.5), paths), backend=backend
    )
    return complex((1 - through[0]) / 0.5)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("wavelength_m", [0.05, 0.3])
def test_g_is_the_fresnel_integral(wavelength_m: float, backend: str) -> None:
    """Against the double integral summed on a grid, turned blob, reflected path."""
    d1, d2 = 1.3 + 0.7, 2.7 + 0.4
    paths = along_x(4.0, wavelength_m, before_m=0.7, behind_m=0.4)
    angle = 0.6
    quat = tensor([math.cos(angle / 2), math.sin(angle / 2), 0.0, 0.0])
    scales, centre = (0.2, 0.12, 0.05), (0.08, -0.06)
    through = shadow(
        *(tensor([1.3, *centre]), quat, tensor(scales), tensor(0.5), paths), backend=backend
    )

    axis = np.linspace(-1.2, 1.2, 1601)
    y, z = np.meshgrid(axis, axis, indexing="ij")
    u = (y - centre[0]) * np.cos(angle) + (z - centre[1]) * np.sin(angle)
    v = (z - centre[1]) * np.cos(angle) - (y - centre[0]) * np.sin(angle)
    blob = np.exp(-0.5 * ((u / scales[1]) ** 2 + (v / scales[2]) ** 2))
    s = 1 / d1 + 1 / d2
    wave = np.exp(-1j * np.pi * s * (y**2 + z**2) / wavelength_m)
    integral = 1j * s / wavelength_m * (blob * wave).sum() * (axis[1] - axis[0]) ** 2
    assert abs(complex((1 - through[0]) / 0.5) - integral) < 1e-6


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_large_opaque_blob_blocks_the_path(backend: str) -> None:
    paths = along_x(5.0, 0.05)
    big = g_of([2.5, 0.0, 0.0], [0.5, 5.0, 5.0], paths, backend)
    assert abs(big - 1) < 1e-2


@pytest.mark.parametrize("backend", BACKENDS)
def test_without_wavelength_the_shadow_is_the_blob_itself(backend: str) -> None:
    sharp = g_of([2.5, 0.1, -0.05], [0.3, 0.1, 0.2], along_x(5.0, 1e-7), backend)
    expected = math.exp(-0.5 * (0.1 / 0.1) ** 2 - 0.5 * (0.05 / 0.2) ** 2)
    assert abs(sharp - expected) < 1e-5


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_small_blob_is_a_huygens_source(backend: str) -> None:
    wavelength_m, d1, d2, offset_m = 0.1, 2.0, 3.0, 0.3
    s, size_m = 1 / d1 + 1 / d2, 2e-3
    tiny = g_of([d1, offset_m, 0.0], [size_m] * 3, along_x(5.0, wavelength_m), backend)
    turned = np.exp(-1j * np.pi * s * offset_m**2 / wavelength_m)
    expected = 1j * s / wavelength_m * 2 * math.pi * size_m**2 * turned
    assert abs(tiny / expected - 1) < 2e-3


@pytest.mark.parametrize("backend", BACKENDS)
def test_only_blobs_beside_the_leg_shadow_it(backend: str) -> None:
    paths = along_x(5.0, 0.05)
    inside = g_of([0.2, 0.0, 0.0], [0.1] * 3, paths, backend)
    assert abs(inside) > 0.5
    assert g_of([-0.01, 0.0, 0.0], [0.1] * 3, paths, backend) == 0
    assert g_of([5.01, 0.0, 0.0], [0.1] * 3, paths, backend) == 0
    halfway = g_of([0.025, 0.0, 0.0], [0.1] * 3, paths, backend)
    assert abs(halfway) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("backend", BACKENDS)
def test_blobs_multiply(backend: str) -> None:
    paths = along_x(5.0, 0.05)
    means = tensor([1.0, 0.05, 0.0], [2.0, -0.1, 0.1])
    scales, alpha = torch.full((2, 3), 0.1, dtype=torch.float64), tensor(0.3, 0.7)
    both = shadow(means, IDENTITY.expand(2, 4), scales, alpha, paths, backend=backend)
    single = [
        shadow(means[[i]], IDENTITY, scales[[i]], alpha[[i]], paths, backend=backend)
        for i in (0, 1)
    ]
    torch.testing.assert_close(both, single[0] * single[1])


def test_a_leg_of_no_length_is_never_shadowed() -> None:
    paths = along_x(5.0, 0.05)
    paths = replace(paths, b_xyz=paths.a_xyz)
    for backend in BACKENDS:
        assert g_of([0.0, 0.0, 0.0], [0.1] * 3, paths, backend) == 0


def test_the_environment_is_friis_with_absolute_delay() -> None:
    paths = along_x(5.0, 0.05)
    subcarriers = Subcarriers(5.9e9, 1e6, 8)
    csi = environment(torch.ones(1, dtype=torch.complex128), paths, subcarriers, 2)
    phase = -2 * math.pi * subcarriers.freq_hz * 5.0 / SPEED_OF_LIGHT
    expected = 0.05 / (4 * math.pi * 5.0) * torch.polar(torch.ones_like(phase), phase)
    torch.testing.assert_close(csi[0], expected)
    assert not csi[1].any()


@pytest.mark.parametrize("backend", BACKENDS)
def test_propagate_adds_both_sums(make_cloud, make_links, make_paths, backend: str) -> None:
    cloud = {name: value.detach() for name, value in make_cloud(5).items()}
    gaussians = RadioGaussians(**cloud, sharpness=2.0)
    links, subcarriers = make_links(4), Subcarriers(5.72e9, 2.5e6, 16)
    paths = make_paths(6, 0.05, num_links=4)
    alone = propagate(gaussians, links, subcarriers, backend=backend)
    full = propagate(gaussians, links, subcarriers, paths, backend=backend)
    through = shadow(
        *(cloud["means"], cloud["quats"], cloud["scales"], cloud["alpha"], paths),
        backend=backend,
    )
    torch.testing.assert_close(full, alone + environment(through, paths, subcarriers, 4))
    assert full.dtype == torch.complex64
    assert isinstance(links, Links)
