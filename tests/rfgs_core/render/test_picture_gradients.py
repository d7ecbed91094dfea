# SPDX-License-Identifier: Apache-2.0
"""Gradients of pictures to Gaussians: closed forms, differences, and the plain twin's autograd."""

from __future__ import annotations

from dataclasses import replace

import numba
import pytest
import torch
from torch import Tensor

from rfgs_core.adam import Adam
from rfgs_core.gaussians import Gaussians
from rfgs_core.render.bench import random_cloud
from rfgs_core.render.rasterizer import splat
from rfgs_core.render.reference import splat_plain
from rfgs_core.render.splat import ALPHA_MAX, DILATION_PX2

SHAPE = ("means", "quats", "log_scales", "logit_opacities")


def leaves_of(
    cloud: Gaussians, values: Tensor, dtype: torch.dtype = torch.float32
) -> tuple[Gaussians, Tensor]:
    """The same, in single precision as programs have them, each asking for its gradient."""
    parts = {name: value.detach().to(dtype).requires_grad_() for name, value in cloud.items()}
    return Gaussians(**parts), values.detach().to(dtype).requires_grad_()


def slopes(
    draw, cloud: Gaussians, values: Tensor, camera, dtype: torch.dtype = torch.float32
) -> dict[str, Tensor]:
    """Gradients of a loss that weighs colours, cover and depth of every pixel differently."""
    there, colours = leaves_of(cloud, values, dtype)
    drawn = draw(there, colours, camera)
    generator = torch.Generator().manual_seed(1)
    weights = torch.randn(drawn.rgb.shape, generator=generator, dtype=torch.float64)
    by_cover = torch.randn(drawn.alpha.shape, generator=generator, dtype=torch.float64)
    well = drawn.alpha.detach() > 0.05
    loss = (drawn.rgb * weights).sum() + (drawn.alpha * by_cover).sum()
    (loss + (drawn.depth * by_cover)[well].sum()).backward()
    parts = {**{name: getattr(there, name) for name in SHAPE}, "values": colours}
    return {
        name: (torch.zeros_like(part) if part.grad is None else part.grad).double()
        for name, part in parts.items()
    }


@pytest.mark.parametrize(
    ("count", "edge_px", "channels", "seed"),
    [(0, 9, 3, 0), (1, 1, 1, 1), (1, 16, 3, 2), (5, 17, 2, 3), (33, 32, 3, 4), (60, 50, 5, 5),
     (60, 31, 1, 6), (47, 15, 4, 7)],
)  # fmt: skip
def test_gradients_are_those_of_the_plain_twin(count, edge_px, channels, seed) -> None:
    cloud, _, camera = random_cloud(count, edge_px, seed)
    values = torch.randn(count, channels, generator=torch.Generator().manual_seed(seed))
    found = slopes(splat, cloud, values, camera)
    exact = slopes(splat_plain, cloud, values, camera, torch.float64)
    for name, expected in exact.items():
        # The cover of the tiled rasteriser is in float32, and expected depths divide by it.
        torch.testing.assert_close(
            found[name], expected, rtol=1e-4, atol=1e-5 * (1.0 + float(expected.abs().sum()))
        )


def test_a_crowd_of_features_has_the_twins_gradients() -> None:
    cloud, _, camera = random_cloud(1500, 75, seed=3)
    values = torch.randn(1500, 32, generator=torch.Generator().manual_seed(2))
    found = slopes(splat, cloud, values, camera)
    exact = slopes(splat_plain, cloud, values, camera, torch.float64)
    for name, expected in exact.items():
        assert float(expected.abs().max()) > 1.0
        difference = (found[name] - expected).norm() / expected.norm()
        assert float(difference) < 2e-3 if name == "quats" else float(difference) < 1e-3, name


def test_one_round_gaussian_has_its_closed_form(camera, gaussians) -> None:
    focal, sigma_m, depth_m, opacity = 40.0, 0.1, 2.0, 0.6
    eye = camera(size=(41, 31), focal=focal)
    round_one = gaussians([[0.0, 0.0, -depth_m]], sigma_m, opacity)
    cloud, rgb = leaves_of(round_one, torch.ones(1, 3))
    off_x, off_y = 2.0, -1.0  # pixels from the middle, (20.5, 15.5)
    splat(cloud, rgb, eye).alpha[14, 22].backward()
    spread = (focal * sigma_m / depth_m) ** 2
    variance = spread + DILATION_PX2
    exponent = (off_x**2 + off_y**2) / (2.0 * variance)
    alpha = opacity * torch.exp(torch.tensor(-exponent)).item()
    per_m = focal / depth_m
    assert cloud.means.grad is not None and cloud.log_scales.grad is not None
    assert cloud.logit_opacities.grad is not None and cloud.quats.grad is not None
    assert float(cloud.logit_opacities.grad[0]) == pytest.approx(alpha * (1.0 - opacity), rel=1e-5)
    # +x of the world is to the right, +y up and rows grow downwards.
    assert float(cloud.means.grad[0, 0]) == pytest.approx(alpha * off_x / variance * per_m)
    assert float(cloud.means.grad[0, 1]) == pytest.approx(alpha * -off_y / variance * per_m)
    # The variance falls with the square of the depth, which is -z.
    by_variance = alpha * exponent / variance
    assert float(cloud.means.grad[0, 2]) == pytest.approx(by_variance * 2.0 * spread / depth_m)
    # Both axes that lie across the view, each of its own part of the distance.
    grown = [alpha * off**2 / variance**2 * spread for off in (off_x, off_y)]
    assert cloud.log_scales.grad[0, :2].tolist() == pytest.approx(grown)
    assert float(cloud.log_scales.grad[0, 2]) == pytest.approx(0.0, abs=1e-12)
    assert float(cloud.quats.grad.abs().max()) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_gradients_are_differences_of_the_picture(camera, gaussians) -> None:
    eye = camera(size=(19, 18), focal=20.0)
    cloud = gaussians([[0.0, 0.0, -1.0], [0.1, 0.05, -1.4], [-0.3, 0.1, -2.0]], 0.2, 0.5)
    generator = torch.Generator().manual_seed(5)
    cloud = replace(
        cloud,
        quats=torch.randn(3, 4, generator=generator),
        log_scales=cloud.log_scales + 0.5 * torch.randn(3, 3, generator=generator),
    )
    there, rgb = leaves_of(cloud, torch.rand(3, 3, generator=generator), torch.float64)
    # Every pixel is well inside of what each Gaussian reaches: nothing is cut off on the way.
    middle = (slice(8, 11), slice(8, 11))

    def picture(means, quats, log_scales, logits, colours) -> Tensor:
        moved = Gaussians(means, quats, log_scales, logits, there.features.detach())
        return splat(moved, colours, eye).rgb[middle]

    assert torch.autograd.gradcheck(picture, (*(getattr(there, n) for n in SHAPE), rgb), atol=1e-5)


def test_a_full_contribution_does_not_move_and_what_hides_nothing_gets_nothing(
    camera, gaussians
) -> None:
    opaque = gaussians([[0.0, 0.0, -1.0], [0.0, 0.0, 3.0]], sigma_m=5.0, opacity=0.99999)
    cloud, rgb = leaves_of(opaque, torch.ones(2, 3))
    drawn = splat(cloud, rgb, camera())
    assert float(drawn.alpha.detach().min()) == pytest.approx(ALPHA_MAX)
    (drawn.rgb.sum() + drawn.alpha.sum()).backward()
    for name in SHAPE:
        slope = getattr(cloud, name).grad
        assert slope is not None and float(slope.abs().max()) == 0.0, name


def test_hidden_gaussians_get_what_the_little_light_behind_gives_them(camera, gaussians) -> None:
    # Eleven layers leave 2e-6 of the light for the last where they are thickest.
    layers = gaussians([[0.0, 0.0, -1.0 - 0.05 * i] for i in range(12)], 0.4, 0.7)
    rgb = torch.linspace(0.1, 1.0, 36).reshape(12, 3)
    eye = camera(size=(16, 16))
    found = _single(splat, layers, rgb, eye, torch.float32)
    exact = _single(splat_plain, layers, rgb, eye, torch.float64)
    assert 0.0 < float(exact[-1].abs()) < 1e-3 * float(exact[0].abs())
    torch.testing.assert_close(found, exact, rtol=1e-4, atol=0.0)


def _single(draw, cloud: Gaussians, rgb: Tensor, eye, dtype: torch.dtype) -> Tensor:
    """Slopes of all brightness by the logits of Gaussians."""
    there, _ = leaves_of(cloud, rgb, dtype)
    draw(there, rgb.to(dtype), eye).rgb.sum().backward()
    assert there.logit_opacities.grad is not None
    return there.logit_opacities.grad.double()


def test_only_what_asks_gets_a_gradient(camera, gaussians) -> None:
    cloud = gaussians([[0.0, 0.0, -1.0]])
    cloud.means.requires_grad_()
    splat(cloud, torch.ones(1, 3), camera()).rgb.sum().backward()
    assert cloud.means.grad is not None and float(cloud.means.grad.abs().max()) > 0.0
    assert cloud.quats.grad is None and cloud.logit_opacities.grad is None
    with torch.no_grad():
        assert not splat(cloud, torch.ones(1, 3), camera()).rgb.requires_grad


def test_a_gaussian_finds_its_place_and_size_in_a_picture(camera, gaussians) -> None:
    eye = camera(size=(48, 40), focal=40.0)
    truth = splat(gaussians([[0.15, -0.1, -2.0]], 0.15, 0.8), torch.ones(1, 3), eye).rgb
    start, rgb = leaves_of(gaussians([[0.0, 0.05, -2.0]], 0.3, 0.6), torch.ones(1, 3))
    adam = Adam({getattr(start, name): 0.02 for name in SHAPE})
    for _ in range(400):
        adam.zero_grad()
        (splat(start, rgb.detach(), eye).rgb - truth).square().sum().backward()
        adam.step()
    # How far away it is cannot be seen, the line of sight can.
    x, y, z = start.means.detach()[0].tolist()
    assert (x / -z, y / -z) == pytest.approx((0.075, -0.05), abs=0.002)
    wide = splat(start, rgb.detach(), eye).alpha.detach()
    assert float((wide - truth[..., 0]).abs().max()) < 0.02


def test_bytes_do_not_depend_on_the_number_of_threads() -> None:
    cloud, rgb, eye = random_cloud(3000, 64, seed=6)
    before = numba.get_num_threads()
    try:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        many = slopes(splat, cloud, rgb, eye)
        numba.set_num_threads(1)
        one = slopes(splat, cloud, rgb, eye)
    finally:
        numba.set_num_threads(before)
    assert all(torch.equal(many[name], one[name]) for name in many)
