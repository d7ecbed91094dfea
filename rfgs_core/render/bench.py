# SPDX-License-Identifier: Apache-2.0
"""How fast the rasteriser is, beside its plain twin in the same run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch

from rfgs_core.bench import fastest
from rfgs_core.device import Device, on_device
from rfgs_core.gaussians.model import FEATURE_DIM, Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.rasterizer import plan_splats, splat
from rfgs_core.render.reference import splat_plain
from rfgs_core.render.tiles import tile_splats


def bench_raster(
    num_gaussians: int = 20_000,
    size_px: int = 256,
    repeats: int = 5,
    seed: int = 0,
    device: Device = "cpu",
) -> dict[str, float]:
    """Renders a random cloud with both rasterisers.

    The twin visits every Gaussian at every pixel, so its time grows with the pixels alone: it
    renders the middle eighth of the rows, and its time is multiplied by eight.

    Args:
        num_gaussians: Gaussians of 1 to 5 cm in a box of 4 × 4 × 2.5 m.
        size_px: Edge of the picture [px].
        repeats: Runs of the tiled rasteriser; the fastest counts. The twin runs once.
        seed: Seed of the cloud.
        device: Where both draw.

    Returns:
        `raster_s` and `twin_s` [s], `raster_ratio` = twin_s / raster_s, and `max_abs_error` over
        colours and alpha in the rows that both rendered.
    """
    gaussians, rgb, camera = random_cloud(num_gaussians, size_px, seed, device)
    splat(gaussians, rgb, camera)  # compiles
    raster_s, tiled = fastest(lambda: splat(gaussians, rgb, camera), repeats)
    band = max(1, size_px // 8)
    top = (size_px - band) // 2
    rows = (top, top + band)
    band_s, twin = fastest(lambda: splat_plain(gaussians, rgb, camera, rows), 1)
    twin_s = band_s * size_px / band
    color_error = (tiled.rgb[top : top + band] - twin.rgb).abs().max()
    alpha_error = (tiled.alpha[top : top + band] - twin.alpha).abs().max()
    return {
        "raster_s": raster_s,
        "twin_s": twin_s,
        "raster_ratio": twin_s / raster_s,
        "max_abs_error": float(max(color_error, alpha_error)),
    }


@dataclass(frozen=True)
class Picture:
    """How long a picture of a random cloud takes."""

    num_gaussians: int
    size_px: int
    """Edge [px]."""
    first_s: float
    """Projected, sorted and drawn [s]."""
    again_s: float
    """Drawn again with other colours [s]."""
    gradients_s: float
    """Drawn, and gradients of Gaussians and colours [s]."""


def time_picture(
    num_gaussians: int, size_px: int, repeats: int = 3, seed: int = 0, device: Device = "cpu"
) -> Picture:
    """Times the tiled rasteriser alone, for clouds that its twin would take minutes for."""
    gaussians, rgb, camera = random_cloud(num_gaussians, size_px, seed, device)
    plan = plan_splats(gaussians, camera)  # compiles
    plan.draw(rgb)
    first_s, _ = fastest(lambda: splat(gaussians, rgb, camera), repeats)
    again_s, _ = fastest(lambda: plan.draw(rgb), repeats)
    gradients_s, _ = fastest(lambda: _with_gradients(gaussians, rgb, camera), repeats + 1)
    return Picture(num_gaussians, size_px, first_s, again_s, gradients_s)


@dataclass(frozen=True)
class Distant:
    """How long a picture of a cloud takes, with what its nearest Gaussians hide and without."""

    num_gaussians: int
    distance_m: float
    """From the camera to the middle of the cloud [m]."""
    every_s: float
    """All that are visible sorted and drawn [s]."""
    shown_s: float
    """As pictures are drawn [s]: hidden ones left out before sorting, where that pays."""
    shown: int
    """Gaussians that were sorted then."""
    max_abs_error: float
    """Largest difference of the two in colours and coverage, of full brightness."""


def time_distant(
    num_gaussians: int, distance_m: float, size_px: int = 512, repeats: int = 3, seed: int = 0
) -> Distant:
    """Times pictures of a random cloud seen from near or afar, on a CPU."""
    gaussians, rgb, _ = random_cloud(num_gaussians, size_px, seed)
    camera = _eye(size_px, distance_m)
    splat(gaussians, rgb, camera)  # compiles
    every_s, every = fastest(lambda: splat(gaussians, rgb, camera, leave_out_hidden=False), repeats)
    shown_s, shown = fastest(lambda: splat(gaussians, rgb, camera), repeats)
    differences = (every.rgb - shown.rgb).abs().max(), (every.alpha - shown.alpha).abs().max()
    return Distant(
        num_gaussians,
        distance_m,
        every_s,
        shown_s,
        len(tile_splats(gaussians, camera, True).rows),
        float(max(differences)),
    )


def _with_gradients(gaussians: Gaussians, rgb: torch.Tensor, camera: Camera) -> torch.Tensor:
    """A picture, its brightness sent back to everything."""
    leaves = {name: value.detach().requires_grad_(True) for name, value in gaussians.items()}
    picture = splat(Gaussians(**leaves), rgb.detach().requires_grad_(True), camera).rgb
    picture.sum().backward()
    return picture


def frames_per_second(gaussians: Gaussians, size_px: int = 256, repeats: int = 3) -> float:
    """Pictures of a person's Gaussians per second, seen from 5 m; the fastest counts."""
    colours = torch.full((len(gaussians), 3), 0.5)
    centred = replace(gaussians.detach(), means=gaussians.means - gaussians.means.mean(dim=0))
    eye = _eye(size_px)
    splat(centred, colours, eye)  # compiles
    return 1.0 / fastest(lambda: splat(centred, colours, eye), repeats)[0]


def random_cloud(
    num_gaussians: int, size_px: int, seed: int, device: Device = "cpu"
) -> tuple[Gaussians, torch.Tensor, Camera]:
    """Gaussians in front of a camera that looks along +y, their colours and the camera."""
    generator = torch.Generator().manual_seed(seed)
    uniform = torch.rand(num_gaussians, 14, generator=generator)
    gaussians = Gaussians(
        means=uniform[:, :3] * torch.tensor([4.0, 4.0, 2.5]) - torch.tensor([2.0, 2.0, 1.25]),
        quats=uniform[:, 3:7] - 0.5,
        log_scales=torch.log(0.01 + 0.04 * uniform[:, 7:10]),
        logit_opacities=torch.logit(0.05 + 0.9 * uniform[:, 10]),
        features=torch.zeros(num_gaussians, FEATURE_DIM),
    )
    return on_device(gaussians, device), uniform[:, 11:14].to(device), _eye(size_px)


def _eye(size_px: int, distance_m: float = 5.0) -> Camera:
    """A camera before the origin that looks along +y."""
    world_from_camera = np.array(
        [[1.0, 0, 0, 0], [0, 0, -1.0, -distance_m], [0, 1.0, 0, 0], [0, 0, 0, 1.0]]
    )
    half = size_px / 2
    return Camera(
        "bench", size_px, size_px, float(size_px), float(size_px), half, half, world_from_camera
    )
