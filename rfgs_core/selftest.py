# SPDX-License-Identifier: Apache-2.0
"""Whether compiled kernels say what their plain twins say on this machine, and how fast."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

from rfgs_core.bench import CloudAndLinks, PropagationBench, cloud_and_links, fastest
from rfgs_core.device import Device, on_device
from rfgs_core.fit.nearest import nearest_gaussian, nearest_on_gpu
from rfgs_core.gaussians.model import FEATURE_DIM, Gaussians
from rfgs_core.propagation import Backend, Subcarriers, propagate
from rfgs_core.render.bench import random_cloud
from rfgs_core.render.cameras import Camera
from rfgs_core.render.rasterizer import splat
from rfgs_core.render.reference import splat_plain
from rfgs_core.render.splat import Splatted

#: Gaussians, links and subcarriers: single ones, and none that fills a block.
SIZES = ((1, 1, 1), (2, 3, 5), (129, 2, 33), (1000, 65, 61))
#: Gaussians and edges of pictures [px].
PICTURES = ((1, 17), (300, 33), (2000, 96))
#: So many, small in their picture, that hidden ones are left out.
CROWD = (60_000, 17)
#: Points, and Gaussians of which each one's nearest is looked for.
NEAREST = ((1, 1), (33, 129), (5000, 20_001))
#: The sizes at which speed is measured: large enough that a GPU does not wait for the CPU.
SPEED: dict[Device, tuple[int, int, int]] = {
    "cpu": (20_000, 64, 64),
    "cuda": (200_000, 256, 64),
}
#: Largest relative errors of channels and gradients in float32 against double.
CHANNEL, GRADIENT = 1e-4, 1e-4
#: The same of pictures and their gradients. On a GPU, drawn in float32, a contribution at the
#: least that counts falls to either side of it, and gsplat stops earlier (`render.gpu`).
PICTURE: dict[Device, float] = {"cpu": 1e-4, "cuda": 1e-3}
#: The same of distances.
NEAR = 1e-5
#: Additions and multiplications of one Gaussian, link and subcarrier: one step of the recurrence
#: (`propagation.kernels_scatter`) and two sums; on a GPU, where neighbours do not wait for each
#: other, sine, cosine and exponential of each (`propagation.kernels_triton`).
OPERATIONS: dict[Device, int] = {"cpu": 12, "cuda": 44}
#: Edge of the matrices whose product shows the chip's ceiling.
_EDGE: dict[Device, int] = {"cpu": 1536, "cuda": 4096}
#: Distance of the far cloud [m], and its carrier [Hz]: 10,000 wavelengths.
_FAR_M, _FAR_HZ = 50.0, 60e9
#: What a picture depends on, beside colours.
_DRAWN = ("means", "quats", "log_scales", "logit_opacities")
_GRADIENTS = ("means", "quats", "scales_rf", "gamma", "alpha")

_Value = TypeVar("_Value")


@dataclass(frozen=True)
class Check:
    """One comparison of a kernel with its twin."""

    what: str
    """Kernel and size, in words."""
    error: float
    """Largest error found."""
    bound: float
    """Largest error allowed."""

    @property
    def holds(self) -> bool:
        """Whether they agree; an error that is no number does not."""
        return self.error <= self.bound


@dataclass(frozen=True)
class Throughput:
    """How fast the propagation model is, against what the chip can do at most."""

    forward_s: float
    """Time of the scattered channel of `SPEED` [s]."""
    rate: float
    """Additions and multiplications per second [1/s]."""
    ceiling: float
    """The most that was measured in the same run, of a product of matrices [1/s]."""


def checks(device: Device) -> Iterator[Check]:
    """Compares every kernel of a device with its twin, in double on the CPU.

    Args:
        device: Where the kernels run.
    """
    for size in SIZES:
        yield from _propagation(f"{size[0]} x {size[1]} x {size[2]}", _scene(*size), device)
    yield from _propagation("60 GHz at 50 m", _far(), device)
    for size in PICTURES:
        yield from _pictures(*size, device)
    if device == "cpu":
        yield _crowd(*CROWD)
    else:
        yield from (_nearest(*size) for size in NEAREST)


def _scene(gaussians: int, links: int, subcarriers: int) -> CloudAndLinks:
    size = PropagationBench(
        num_gaussians=gaussians, num_links=links, num_subcarriers=subcarriers, seed=gaussians
    )
    return cloud_and_links(size)


def _far() -> CloudAndLinks:
    """A cloud so many wavelengths away that phases take more digits than float32 has."""
    scene = cloud_and_links(PropagationBench(200, 8, 32, center_hz=_FAR_HZ, seed=5))
    away = torch.tensor([_FAR_M, 0.0, 0.0])
    moved = replace(scene.gaussians, means=scene.gaussians.means + away)
    subcarriers = Subcarriers(_FAR_HZ, 12.5e6, 32)
    return replace(scene, gaussians=moved, subcarriers=subcarriers)


def _propagation(name: str, scene: CloudAndLinks, device: Device) -> Iterator[Check]:
    """What a scene scatters, what its Gaussians leave of the environment, and all gradients."""
    here, exact = on_device(scene, device), _in_double(scene)
    for what, paths in (("scattered", False), ("with shadows", True)):
        found, slopes = _with_gradients(here, paths, None)
        plain, true_slopes = _with_gradients(exact, paths, "torch")
        yield Check(f"channel {what}, {name}", _relative(found, plain), CHANNEL)
        worst = max(_relative(slopes[key], true_slopes[key]) for key in _GRADIENTS)
        yield Check(f"gradients {what}, {name}", worst, GRADIENT)
        if not paths:
            # A kernel of its own: the adjoint with which reflectivities are solved.
            alone = _with_gradients(here, paths, None, ("gamma",))[1]["gamma"]
            error = _relative(alone, true_slopes["gamma"])
            yield Check(f"gradient of reflectivity, {name}", error, GRADIENT)


def _with_gradients(
    scene: CloudAndLinks,
    shadows: bool,
    backend: Backend | None,
    wanted: tuple[str, ...] = _GRADIENTS,
) -> tuple[Tensor, dict[str, Tensor]]:
    leaves = {
        key: getattr(scene.gaussians, key).detach().clone().requires_grad_(True) for key in wanted
    }
    gaussians = replace(scene.gaussians, **leaves)
    paths = scene.paths if shadows else None
    csi = propagate(gaussians, scene.links, scene.subcarriers, paths, backend=backend)
    torch.autograd.backward(csi, scene.grad.to(csi.dtype))
    slopes = {
        key: torch.zeros_like(leaf) if leaf.grad is None else leaf.grad
        for key, leaf in leaves.items()
    }
    return csi.detach(), slopes


def _in_double(value: _Value) -> _Value:
    """The same tensors in double precision, on the CPU."""
    if isinstance(value, Tensor):
        wide = {torch.float32: torch.float64, torch.complex64: torch.complex128}
        return value.cpu().to(wide.get(value.dtype, value.dtype))  # type: ignore[return-value]
    if not hasattr(value, "__dataclass_fields__"):
        return value
    parts = {spec.name: _in_double(getattr(value, spec.name)) for spec in fields(value)}  # type: ignore[arg-type]
    return replace(value, **parts)  # type: ignore[type-var]


def _relative(found: Tensor, true: Tensor) -> float:
    """Norm of the difference over the norm of what is true."""
    size = float(true.norm())
    return float((found.cpu().to(true.dtype) - true).norm()) / (size if size > 0.0 else 1.0)


def _pictures(gaussians: int, edge_px: int, device: Device) -> Iterator[Check]:
    """Colours, features and all gradients, beside the plain twin in double."""
    cloud, rgb, camera = random_cloud(gaussians, edge_px, seed=gaussians)
    features = torch.randn(gaussians, FEATURE_DIM, generator=torch.Generator().manual_seed(1))
    for what, values in (("3 colours", rgb), ("32 features", features)):
        found = _drawn(splat, on_device(cloud, device), values.to(device), camera)
        exact = _drawn(splat_plain, cloud, values, camera)
        for part, kind in enumerate(("picture", "gradients")):
            pairs = zip(found[part], exact[part], strict=True)
            worst = max(_relative(one, other) for one, other in pairs)
            yield Check(f"{kind} of {what}, {gaussians} at {edge_px} px", worst, PICTURE[device])


def _crowd(gaussians: int, edge_px: int) -> Check:
    """A picture that leaves out what is hidden, beside the plain twin that draws everything."""
    cloud, rgb, camera = random_cloud(gaussians, edge_px, seed=gaussians)
    found, exact = splat(cloud, rgb, camera), splat_plain(cloud, rgb, camera)
    worst = max(_relative(found.rgb, exact.rgb), _relative(found.alpha, exact.alpha))
    return Check(f"picture of a crowd, {gaussians} at {edge_px} px", worst, PICTURE["cpu"])


def _nearest(points: int, gaussians: int) -> Check:
    """Distances to the nearest Gaussians, beside the tree of the CPU."""
    generator = torch.Generator().manual_seed(gaussians)
    places, means = (torch.randn(count, 3, generator=generator) for count in (points, gaussians))
    _, found = nearest_on_gpu(places.cuda(), means.cuda())
    _, exact = nearest_gaussian(places, means)
    return Check(f"nearest of {gaussians}, {points} points", _relative(found, exact), NEAR)


def _drawn(
    draw: Callable[[Gaussians, Tensor, Camera], Splatted],
    cloud: Gaussians,
    values: Tensor,
    camera: Camera,
) -> tuple[list[Tensor], list[Tensor]]:
    """Picture and coverage, and the gradients of everything that they depend on."""
    parts = {**dict(cloud.items()), "values": values}
    leaves = {name: part.detach().requires_grad_(True) for name, part in parts.items()}
    there = Gaussians(**{name: leaves[name] for name, _ in cloud.items()})
    picture = draw(there, leaves["values"], camera)
    # Some direction that no symmetry of a picture hides.
    ramp = torch.linspace(0.5, 1.5, picture.rgb.numel()).to(picture.rgb)
    (picture.rgb * ramp.reshape(picture.rgb.shape)).sum().backward()
    slopes = [torch.as_tensor(leaves[name].grad) for name in (*_DRAWN, "values")]
    return [picture.rgb.detach(), picture.alpha.detach()], slopes


def throughput(device: Device, repeats: int = 5) -> Throughput:
    """Measures the forward model, and the chip's ceiling in the same run."""
    scene = on_device(_scene(*SPEED[device]), device)

    def forward() -> Tensor:
        with torch.no_grad():
            return propagate(scene.gaussians, scene.links, scene.subcarriers)

    forward()
    best_s, _ = fastest(forward, repeats)
    rate = OPERATIONS[device] * float(np.prod(SPEED[device])) / best_s
    return Throughput(best_s, rate, _ceiling(device, repeats))


def _ceiling(device: Device, repeats: int) -> float:
    """Additions and multiplications per second of a product of float32 matrices [1/s]."""
    edge = _EDGE[device]
    left = torch.rand(edge, edge, device=device)
    torch.backends.cuda.matmul.allow_tf32 = False

    torch.mm(left, left)
    return 2.0 * edge**3 / fastest(lambda: torch.mm(left, left), repeats)[0]
