# SPDX-License-Identifier: Apache-2.0
"""Random clouds, links and paths of a room."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch

from rfgs_core.propagation import EnvironmentPaths, Links
from rfgs_core.radio.constants import SPEED_OF_LIGHT

MakeCloud = Callable[..., dict[str, torch.Tensor]]


@pytest.fixture
def make_cloud() -> MakeCloud:
    """Leaves of a graph: Gaussians the size of a person in the middle of a room."""

    def make(
        count: int,
        center_hz: float = 5.8e9,
        knots: int = 1,
        groups: int = 3,
        dtype: torch.dtype = torch.float32,
    ) -> dict[str, torch.Tensor]:
        generator = torch.Generator().manual_seed(1)

        def normal(*size: int) -> torch.Tensor:
            return torch.randn(*size, generator=generator, dtype=torch.float64)

        spread = torch.tensor([0.2, 0.2, 0.4], dtype=torch.float64)
        scales = 0.04 * torch.exp(0.3 * normal(count, 3))
        values = {
            "means": normal(count, 3) * spread + torch.tensor([2.5, 2.0, 1.0]),
            "quats": normal(count, 4),
            "scales": scales,
            "scales_rf": scales * SPEED_OF_LIGHT / center_hz,
            "gamma": torch.complex(normal(count, knots), normal(count, knots)),
            "alpha": 0.5 * torch.sigmoid(normal(count)),
            "normals": torch.nn.functional.normalize(normal(count, 3), dim=1),
            "visibility": torch.sigmoid(normal(count, groups)),
        }
        for name, value in values.items():
            target = dtype.to_complex() if name == "gamma" else dtype
            values[name] = value.to(target).requires_grad_(True)
        return values

    return make


@pytest.fixture
def make_links() -> Callable[[int], Links]:
    """Links across the room, in three groups."""

    def make(count: int) -> Links:
        generator = torch.Generator().manual_seed(2)
        offsets = 0.1 * torch.randn(2, count, 3, generator=generator, dtype=torch.float64)
        return Links(
            torch.tensor([0.2, 0.3, 1.2]) + offsets[0],
            torch.tensor([4.8, 3.5, 2.2]) + offsets[1],
            torch.arange(count) % 3,
        )

    return make


@pytest.fixture
def make_paths() -> Callable[..., EnvironmentPaths]:
    """Paths past the cloud, some reflected before or behind the leg."""

    def make(count: int, wavelength_m: float, num_links: int = 1) -> EnvironmentPaths:
        generator = torch.Generator().manual_seed(3)

        def normal(*size: int) -> torch.Tensor:
            return torch.randn(*size, generator=generator, dtype=torch.float64)

        a_xyz = torch.tensor([0.2, 0.3, 1.2]) + 0.1 * normal(count, 3)
        b_xyz = torch.tensor([4.8, 3.5, 1.2]) + 0.2 * normal(count, 3)
        extra_a_m, extra_b_m = normal(count).abs(), normal(count).abs()
        length_m = extra_a_m + extra_b_m + (a_xyz - b_xyz).norm(dim=1)
        return EnvironmentPaths(
            link=torch.arange(count) % num_links,
            amplitude=torch.complex(normal(count), normal(count)) * 1e-3,
            delay_s=length_m / SPEED_OF_LIGHT,
            a_xyz=a_xyz,
            b_xyz=b_xyz,
            extra_a_m=extra_a_m,
            extra_b_m=extra_b_m,
            wavelength_m=wavelength_m,
        )

    return make


def _value_and_gradients(run, cloud, backend, real, device) -> dict[str, torch.Tensor]:
    """Output and gradients of a random real function of it."""
    leaves = {
        name: value.detach()
        .to(device, real.to_complex() if value.is_complex() else real)
        .requires_grad_(True)
        for name, value in cloud.items()
    }
    output = run(leaves, backend)
    generator = torch.Generator().manual_seed(5)
    weight = torch.randn(*output.shape, 2, generator=generator, dtype=torch.float64).to(device)
    grads = torch.autograd.grad((torch.view_as_real(output) * weight).sum(), list(leaves.values()))
    return {"output": output.detach(), **dict(zip(leaves, grads, strict=True))}


@pytest.fixture
def assert_twins_agree() -> Callable[..., None]:
    """Holds a twin in single precision against the plain one in double, gradients too."""

    def check(run, cloud, backend: str = "numba", device: str = "cpu") -> None:
        fast = _value_and_gradients(run, cloud, backend, torch.float32, device)
        plain = _value_and_gradients(run, cloud, "torch", torch.float64, device)
        for name, expected in plain.items():
            error = (fast[name] - expected).norm() / expected.norm()
            assert error < 1e-4, f"{name}: {error:.1e}"
            assert expected.norm() > 0, name

    return check
