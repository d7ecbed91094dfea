# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: each measures a part beside its plain twin, in the same run."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TypeVar

import torch
from jaxtyping import Complex, Float
from torch import Tensor

from rfgs_core.device import finish_device, on_device
from rfgs_core.propagation import (
    EnvironmentPaths,
    Links,
    RadioGaussians,
    Subcarriers,
    environment,
    propagate,
    scatter,
    shadow,
)
from rfgs_core.propagation.reference import MAX_ELEMENTS
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Block size [gaussian, link, subcarrier] at which the plain twin is fastest on common processors.
_TUNED_ELEMENTS = 1 << 17

_Result = TypeVar("_Result")

#: Tensor fields of `RadioGaussians` whose gradients are compared.
_COMPARED = ("means", "quats", "scales", "scales_rf", "gamma", "alpha")


@dataclass(frozen=True)
class PropagationBench:
    """Size of the propagation benchmark: a person-sized cloud in a room at Wi-Fi."""

    num_gaussians: int = 20_000
    """Gaussians, standing in a box of 0.6 x 0.6 x 1.7 m."""
    num_links: int = 64
    """Links, from one transmitter to a receiving array across the room."""
    num_subcarriers: int = 64
    """Subcarriers."""
    paths_per_link: int = 2
    """Environment paths of each link that the cloud shadows."""
    center_hz: float = 5.8e9
    """Centre frequency [Hz]."""
    spacing_hz: float = 2.5e6
    """Distance of subcarriers [Hz]."""
    repeats: int = 5
    """Runs of the fast twin; the plain one runs twice. The best counts."""
    seed: int = 0
    """Seed of the random cloud."""
    device: str = "cpu"
    """Where both twins run."""


@dataclass(frozen=True)
class CloudAndLinks:
    """Inputs that both twins get, and a random gradient of the CSI."""

    gaussians: RadioGaussians
    links: Links
    subcarriers: Subcarriers
    paths: EnvironmentPaths
    grad: Complex[Tensor, "link subcarrier"]


def bench_propagation(config: PropagationBench | None = None) -> dict[str, float | int | str]:
    """Times the compiled propagation model beside its plain torch twin, on one device.

    Both compute the full model in float32: scattering and shadowed environment paths. The twin
    works through the Gaussians in blocks, as otherwise its arrays of [gaussian, link, subcarrier]
    would not fit into memory; it sees each block's gradient at once, which costs it nothing.
    The `tuned` numbers are the same twin with blocks small enough for the processor's cache.

    Args:
        config: Sizes; None: 20,000 Gaussians x 64 links x 64 subcarriers.

    Returns:
        A flat dictionary: ratios, largest relative error of CSI and gradients (norms, per
        tensor), seconds of each twin, sizes and hardware.
    """
    config = config or PropagationBench()
    scene = cloud_and_links(config)
    with_gradients(scene)  # Compiles, or loads compiled code.
    fast_s, (fast_csi, fast_grads) = fastest(lambda: with_gradients(scene), config.repeats)
    fast_forward_s, _ = fastest(lambda: _fast_forward(scene), config.repeats)
    plain_forward_s, _ = fastest(lambda: _plain(scene, MAX_ELEMENTS, False), 2)
    plain_s, (plain_csi, plain_grads) = fastest(lambda: _plain(scene, MAX_ELEMENTS, True), 2)
    tuned_forward_s, _ = fastest(lambda: _plain(scene, _TUNED_ELEMENTS, False), 2)
    tuned_s, _ = fastest(lambda: _plain(scene, _TUNED_ELEMENTS, True), 1)
    errors = [_relative(fast_csi, plain_csi)]
    errors += [_relative(fast_grads[name], plain_grads[name]) for name in _COMPARED]
    return {
        "forward_ratio": plain_forward_s / fast_forward_s,
        "forward_backward_ratio": plain_s / fast_s,
        "tuned_forward_ratio": tuned_forward_s / fast_forward_s,
        "tuned_forward_backward_ratio": tuned_s / fast_s,
        "max_relative_error": max(errors),
        "forward_s": fast_forward_s,
        "forward_backward_s": fast_s,
        "plain_forward_s": plain_forward_s,
        "plain_forward_backward_s": plain_s,
        "tuned_forward_s": tuned_forward_s,
        "tuned_forward_backward_s": tuned_s,
        **{field.name: getattr(config, field.name) for field in fields(config)},
        **hardware(),
        "torch_threads": torch.get_num_threads(),
        "torch": torch.__version__,
    }


def cloud_and_links(config: PropagationBench) -> CloudAndLinks:
    """A random cloud between a transmitter and an array, float32."""
    generator = torch.Generator().manual_seed(config.seed)

    def uniform(*size: int) -> Tensor:
        return torch.rand(*size, generator=generator, dtype=torch.float64)

    def normal(*size: int) -> Tensor:
        return torch.randn(*size, generator=generator, dtype=torch.float64)

    count, links = config.num_gaussians, config.num_links
    wavelength_m = SPEED_OF_LIGHT / config.center_hz
    scales = 0.02 * torch.exp(0.3 * normal(count, 3))
    box = torch.tensor([0.6, 0.6, 1.7], dtype=torch.float64)
    # k * 2 * scale_rf = 0.5: where fits start.
    shrink = 0.25 * wavelength_m / (2 * torch.pi) / 0.02
    gaussians = RadioGaussians(
        means=(torch.tensor([2.2, 1.9, 0.0]) + box * uniform(count, 3)).float(),
        quats=normal(count, 4).float(),
        scales=scales.float(),
        scales_rf=(scales * shrink).float(),
        gamma=torch.complex(normal(count, 1), normal(count, 1)).to(torch.complex64) * 1e-2,
        # The whole cloud blocks a good part of the power, not all of it.
        alpha=(uniform(count) * min(0.5, 100.0 / count)).float(),
    )
    grid = torch.stack(
        [torch.zeros(links), torch.arange(links) % 8, torch.arange(links) // 8], dim=1
    ).to(torch.float64)
    link_rows = Links(
        torch.tensor([[0.2, 0.2, 1.2]], dtype=torch.float64).expand(links, 3),
        torch.tensor([4.8, 3.8, 1.2], dtype=torch.float64) + 0.5 * wavelength_m * grid,
    )
    subcarriers = Subcarriers(
        config.center_hz - 0.5 * config.spacing_hz * config.num_subcarriers,
        config.spacing_hz,
        config.num_subcarriers,
    )
    csi_shape = (links, config.num_subcarriers)
    grad = torch.complex(normal(*csi_shape), normal(*csi_shape)).to(torch.complex64)
    paths = _paths(link_rows, config.paths_per_link, wavelength_m, uniform)
    return on_device(CloudAndLinks(gaussians, link_rows, subcarriers, paths, grad), config.device)


def _paths(
    links: Links, per_link: int, wavelength_m: float, uniform: Callable[..., Tensor]
) -> EnvironmentPaths:
    """Direct paths and longer ones whose last leg comes from somewhere behind the cloud."""
    link = torch.arange(len(links)).repeat_interleave(per_link)
    extra_a_m = (3 * uniform(len(link))) * (torch.arange(len(link)) % per_link > 0)
    a_xyz = links.tx_xyz[link] + (uniform(len(link), 3) - 0.5) * (extra_a_m[:, None] > 0)
    b_xyz = links.rx_xyz[link]
    length_m = extra_a_m + torch.linalg.vector_norm(b_xyz - a_xyz, dim=1)
    return EnvironmentPaths(
        link=link,
        amplitude=(wavelength_m / (4 * torch.pi * length_m)).to(torch.complex64),
        delay_s=length_m / SPEED_OF_LIGHT,
        a_xyz=a_xyz,
        b_xyz=b_xyz,
        extra_a_m=extra_a_m,
        extra_b_m=torch.zeros_like(extra_a_m),
        wavelength_m=wavelength_m,
    )


def _leaves(gaussians: RadioGaussians) -> RadioGaussians:
    """The same values as fresh leaves of a graph."""
    return replace(
        gaussians,
        **{name: getattr(gaussians, name).detach().requires_grad_(True) for name in _COMPARED},
    )


def _grads(gaussians: RadioGaussians) -> dict[str, Tensor]:
    """Gradients of all compared tensors; zero where nothing arrived."""
    leaves = {name: getattr(gaussians, name) for name in _COMPARED}
    return {
        name: torch.zeros_like(leaf) if leaf.grad is None else leaf.grad
        for name, leaf in leaves.items()
    }


def _fast_forward(scene: CloudAndLinks) -> Complex[Tensor, "link subcarrier"]:
    """CSI of the compiled model without a graph."""
    with torch.no_grad():
        return propagate(scene.gaussians, scene.links, scene.subcarriers, scene.paths)


def _pull(csi: Complex[Tensor, "link subcarrier"], scene: CloudAndLinks) -> None:
    """Sends the scene's gradient back through the CSI."""
    torch.autograd.backward(csi, scene.grad)


def with_gradients(scene: CloudAndLinks) -> tuple[Tensor, dict[str, Tensor]]:
    """CSI and gradients of the compiled model."""
    g = _leaves(scene.gaussians)
    csi = propagate(g, scene.links, scene.subcarriers, scene.paths)
    _pull(csi, scene)
    return csi.detach(), _grads(g)


def _plain(
    scene: CloudAndLinks, elements: int, gradients: bool
) -> tuple[Tensor, dict[str, Tensor]]:
    """CSI and gradients of the plain twin, in blocks of `elements` of (M, link, subcarrier)."""
    g = _leaves(scene.gaussians)
    links, subcarriers, paths = scene.links, scene.subcarriers, scene.paths
    rows = max(1, elements // (len(links) * subcarriers.num_selected))
    with torch.set_grad_enabled(gradients):
        through = shadow(g.means, g.quats, g.scales, g.alpha, paths, backend="torch")
        csi = environment(through, paths, subcarriers, len(links))
        total = csi.detach()
        if gradients:
            _pull(csi, scene)
        for first in range(0, g.means.shape[0], rows):
            part = slice(first, first + rows)
            block = (g.means[part], g.quats[part], g.scales_rf[part], g.gamma[part])
            csi = scatter(*block, links, subcarriers, backend="torch")
            if gradients:
                _pull(csi, scene)
            total = total + csi.detach()
    return total, _grads(g)


def _relative(value: Float[Tensor, "..."], expected: Float[Tensor, "..."]) -> float:
    """Norm of the difference over the norm of what is expected."""
    return ((value - expected).norm() / expected.norm()).item()


def fastest(run: Callable[[], _Result], repeats: int) -> tuple[float, _Result]:
    """Shortest time of `repeats` runs [s] with what a GPU was asked to do, and the last result."""
    start = time.perf_counter()
    result = run()
    finish_device()
    best_s = time.perf_counter() - start
    for _ in range(repeats - 1):
        start = time.perf_counter()
        result = run()
        finish_device()
        best_s = min(best_s, time.perf_counter() - start)
    return best_s, result


def hardware() -> dict[str, str | int]:
    """Processor, its cores and the GPU, if any, that times belong to."""
    cpu_info = Path("/proc/cpuinfo")
    names = [
        line.split(":", 1)[1].strip()
        for line in (cpu_info.read_text().splitlines() if cpu_info.exists() else [])
        if line.startswith("model name")
    ]
    return {
        "cpu": names[0] if names else platform.processor(),
        "cores": os.cpu_count() or 1,
        "gpu": torch.cuda.get_device_name(0) if torch.cuda.is_available() else "none",
    }
