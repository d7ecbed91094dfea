# SPDX-License-Identifier: Apache-2.0
"""The tiled rasteriser against closed forms and against its plain twin."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest
import torch

from rfgs_core.gaussians import Gaussians
from rfgs_core.render.bench import bench_raster, random_cloud
from rfgs_core.render.cameras import Camera
from rfgs_core.render.rasterizer import SMALL_ENTRIES, plan_splats, splat
from rfgs_core.render.reference import splat_plain
from rfgs_core.render.splat import NEAR_M

BOTH = pytest.mark.parametrize("draw", [splat, splat_plain], ids=["tiled", "plain"])


@BOTH
def test_one_round_gaussian_on_the_axis_has_its_closed_form(draw, camera, gaussians) -> None:
    eye = camera(size=(41, 31), focal=40.0)
    sigma_m, depth_m, opacity = 0.1, 2.0, 0.6
    picture = draw(gaussians([[0.0, 0.0, -depth_m]], sigma_m, opacity), torch.ones(1, 3), eye)
    variance = (40.0 * sigma_m / depth_m) ** 2 + 0.3
    row, column = np.mgrid[0:31, 0:41] + 0.5
    expected = opacity * np.exp(-((column - 20.5) ** 2 + (row - 15.5) ** 2) / (2 * variance))
    expected[expected < 1 / 255] = 0.0
    assert expected.max() == pytest.approx(opacity)
    np.testing.assert_allclose(picture.alpha, expected, atol=1e-6)
    np.testing.assert_allclose(picture.rgb[..., 1], expected, atol=1e-6)
    drawn = expected > 0
    np.testing.assert_allclose(picture.depth.numpy()[drawn], depth_m, rtol=1e-6)
    assert torch.isinf(picture.depth[torch.from_numpy(~drawn)]).all()


@BOTH
def test_flat_turned_gaussian_has_the_projected_covariance(draw, camera, gaussians) -> None:
    eye = camera(size=(64, 64), focal=60.0)
    thin = gaussians([[0.0, 0.0, -3.0]], opacity=0.9)
    thin.log_scales = torch.log(torch.tensor([[0.4, 0.05, 0.01]]))
    angle = np.deg2rad(30.0)  # about the viewing axis, anticlockwise in the world
    thin.quats = 3.0 * torch.tensor([[np.cos(angle / 2), 0, 0, np.sin(angle / 2)]]).float()
    alpha = np.asarray(draw(thin, torch.ones(1, 3), eye).alpha, np.float64)
    row, column = np.mgrid[0:64, 0:64] + 0.5
    along = np.array([np.cos(angle), -np.sin(angle)])  # rows grow downwards
    across = np.array([np.sin(angle), np.cos(angle)])
    offset = np.stack([column - 32, row - 32], -1)
    exponent = (offset @ along) ** 2 / (8.0**2 + 0.3) + (offset @ across) ** 2 / (1.0**2 + 0.3)
    expected = 0.9 * np.exp(-0.5 * exponent)
    expected[expected < 1 / 255] = 0.0
    np.testing.assert_allclose(alpha, expected, atol=2e-6)


@BOTH
@pytest.mark.parametrize("nearest_first", [True, False])
def test_the_nearer_gaussian_hides_the_farther(draw, camera, gaussians, nearest_first) -> None:
    eye = camera(size=(33, 33))
    depths, colors = [1.0, 4.0], torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    if not nearest_first:
        depths, colors = depths[::-1], colors.flip(0)
    pair = gaussians([[0.0, 0.0, -depth] for depth in depths], sigma_m=0.5, opacity=0.8)
    middle = draw(pair, colors, eye).rgb[16, 16]
    np.testing.assert_allclose(middle, [0.8, 0.2 * 0.8, 0.0], atol=1e-6)
    depth = draw(pair, colors, eye).depth[16, 16]
    assert float(depth) == pytest.approx((0.8 * 1.0 + 0.16 * 4.0) / 0.96, abs=1e-5)


@BOTH
def test_contribution_of_one_gaussian_is_clamped(draw, camera, gaussians) -> None:
    opaque = gaussians([[0.0, 0.0, -1.0]], sigma_m=1.0, opacity=0.9999)
    assert float(draw(opaque, torch.ones(1, 3), camera()).alpha.max()) == pytest.approx(0.99)


@BOTH
def test_nothing_is_drawn_behind_beside_or_too_faint(draw, camera, gaussians) -> None:
    eye = camera()
    places = [[0, 0, 2.0], [0, 0, -0.9 * NEAR_M], [9.0, 0, -2.0], [0, -9.0, -2.0]]
    hidden = gaussians(places, sigma_m=0.05)
    assert float(draw(hidden, torch.ones(4, 3), eye).alpha.sum()) == 0.0
    faint = gaussians([[0.0, 0.0, -2.0]], opacity=0.5 / 255)
    assert float(draw(faint, torch.ones(1, 3), eye).alpha.sum()) == 0.0
    empty = draw(Gaussians.none(), torch.zeros(0, 3), eye)
    assert float(empty.rgb.sum()) == 0.0
    assert torch.isinf(empty.depth).all()


@BOTH
def test_gaussian_cut_by_the_border_is_drawn_in_part(draw, camera, gaussians) -> None:
    eye = camera(size=(32, 24))
    # Centre at column -2, row 12.
    border = gaussians([[-18.0 / 40.0 * 2.0, 0.0, -2.0]], sigma_m=0.15, opacity=0.9)
    alpha = draw(border, torch.ones(1, 3), eye).alpha
    assert float(alpha[:, 0].max()) > 0.3
    assert float(alpha[:, 20:].sum()) == 0.0


@pytest.mark.parametrize("size_px", [64, 75])
def test_tiled_agrees_with_the_plain_twin(size_px: int) -> None:
    cloud, rgb, eye = random_cloud(1500, size_px, seed=3)
    tiled, plain = splat(cloud, rgb, eye), splat_plain(cloud, rgb, eye)
    assert float(plain.alpha.max()) > 0.9
    np.testing.assert_allclose(tiled.rgb, plain.rgb, atol=2e-5)
    np.testing.assert_allclose(tiled.alpha, plain.alpha, atol=2e-5)
    covered = plain.alpha > 0.01
    np.testing.assert_allclose(tiled.depth[covered], plain.depth[covered], rtol=1e-4)
    assert (torch.isinf(tiled.depth) == torch.isinf(plain.depth)).all()


def test_32_features_are_drawn_as_the_plain_twin_draws_them() -> None:
    cloud, _, camera = random_cloud(200, 40, seed=3)
    values = torch.randn(200, 32, generator=torch.Generator().manual_seed(4))
    leaves = [values.clone().requires_grad_(True) for _ in range(2)]
    tiled, plain = splat(cloud, leaves[0], camera), splat_plain(cloud, leaves[1], camera)
    torch.testing.assert_close(tiled.rgb.double(), plain.rgb, rtol=0.0, atol=2e-5)
    ramp = torch.linspace(-1.0, 2.0, plain.rgb.numel()).reshape(plain.rgb.shape)
    for drawn in (tiled, plain):
        (drawn.rgb * ramp).sum().backward()
    assert leaves[1].grad is not None and float(leaves[1].grad.abs().max()) > 1.0
    torch.testing.assert_close(leaves[0].grad, leaves[1].grad, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "value"),
    [("quats", 0.0), ("quats", torch.nan), ("log_scales", 800.0), ("means", torch.nan),
     ("means", torch.inf), ("logit_opacities", torch.nan)],
)  # fmt: skip
def test_what_has_no_shape_or_place_is_not_drawn(name: str, value: float) -> None:
    cloud, rgb, camera = random_cloud(50, 33, seed=3)
    damaged = getattr(cloud, name).clone()
    damaged[7] = value
    rest = torch.arange(50) != 7
    found = splat(replace(cloud, **{name: damaged}), rgb, camera)
    expected = splat(cloud.select(rest), rgb[rest], camera)
    assert torch.equal(found.rgb, expected.rgb) and torch.equal(found.depth, expected.depth)


def test_a_gaussian_larger_than_any_room_covers_everything() -> None:
    cloud, rgb, camera = random_cloud(50, 33, seed=3)
    sizes = cloud.log_scales.clone()
    sizes[7] = 60.0
    vast = replace(cloud, log_scales=sizes)
    tiled, plain = splat(vast, rgb, camera), splat_plain(vast, rgb, camera)
    assert float(plain.alpha.min()) > 0.05
    torch.testing.assert_close(tiled.rgb.double(), plain.rgb, rtol=0.0, atol=2e-5)


def test_stopping_early_behind_opaque_layers_stays_within_tolerance(camera, gaussians) -> None:
    layers = gaussians([[0.0, 0.0, -1.0 - 0.01 * i] for i in range(40)], 0.4, 0.7)
    rgb = torch.linspace(0, 1, 120).reshape(40, 3)
    eye = camera(size=(48, 48))
    tiled, plain = splat(layers, rgb, eye), splat_plain(layers, rgb, eye)
    np.testing.assert_allclose(tiled.rgb, plain.rgb, atol=2e-5)


@pytest.mark.parametrize("draw", [splat, splat_plain])
def test_a_part_of_a_picture_is_a_picture_of_its_own(draw, gaussians) -> None:
    """Cameras with shift: the optical axis of the right half stands at its left edge."""
    whole = Camera("whole", 200, 120, 100.0, 100.0, 100.0, 60.0, np.eye(4))
    half = Camera("half", 100, 120, 100.0, 100.0, 0.0, 60.0, np.eye(4))
    cloud = gaussians([[2.7, 0.3, -3.0], [1.2, -0.5, -2.0]], 0.15, 0.9)
    rgb = torch.rand(2, 3, generator=torch.Generator().manual_seed(1))
    seen, cut = draw(cloud, rgb, whole), draw(cloud, rgb, half)
    assert float(cut.alpha[:, 70:].max()) > 0.5
    np.testing.assert_allclose(cut.rgb, seen.rgb[:, 100:], atol=1e-6)
    np.testing.assert_allclose(cut.alpha, seen.alpha[:, 100:], atol=1e-6)


def test_gradient_to_colours_equals_autograd_of_the_twin() -> None:
    cloud, rgb, eye = random_cloud(300, 40, seed=4)
    weight = torch.rand(40, 40, 3, generator=torch.Generator().manual_seed(5))
    tiled, plain = rgb.clone().requires_grad_(), rgb.double().requires_grad_()
    (splat(cloud, tiled, eye).rgb * weight).sum().backward()
    (splat_plain(cloud, plain, eye).rgb * weight).sum().backward()
    assert tiled.grad is not None and plain.grad is not None
    assert float(plain.grad.abs().max()) > 0.1
    np.testing.assert_allclose(tiled.grad, plain.grad, atol=1e-4)


@pytest.mark.slow
def test_gradcheck_of_colours(camera, gaussians) -> None:
    cloud = gaussians([[0.0, 0.0, -1.0], [0.1, 0.05, -1.4], [9.0, 0.0, -1.0]], opacity=0.7)
    plan = plan_splats(cloud, camera(size=(12, 9), focal=12.0))
    rgb = torch.rand(3, 3, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda colors: plan.draw(colors).rgb, (rgb,))


def test_frozen_geometry_gets_no_gradient(camera, gaussians) -> None:
    cloud = gaussians([[0.0, 0.0, -1.0]])
    cloud.means.requires_grad_()
    rgb = torch.ones(1, 3, requires_grad=True)
    plan_splats(cloud, camera()).draw(rgb).rgb.sum().backward()
    assert rgb.grad is not None
    assert cloud.means.grad is None


def test_bytes_do_not_depend_on_the_number_of_threads() -> None:
    cloud, rgb, eye = random_cloud(3000, 64, seed=6)
    assert len(plan_splats(cloud, eye).tiles.entries) > SMALL_ENTRIES

    def draw() -> tuple[bytes, bytes]:
        colors = rgb.clone().requires_grad_()
        picture = splat(cloud, colors, eye).rgb
        picture.square().sum().backward()
        assert colors.grad is not None
        return picture.detach().numpy().tobytes(), colors.grad.numpy().tobytes()

    before = numba.get_num_threads()
    try:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        many = draw()
        numba.set_num_threads(1)
        assert draw() == many
    finally:
        numba.set_num_threads(before)


def test_bench_reports_speed_beside_the_twin() -> None:
    numbers = bench_raster(num_gaussians=3000, size_px=64, repeats=2)
    assert set(numbers) == {"raster_ratio", "raster_s", "twin_s", "max_abs_error"}
    assert numbers["max_abs_error"] < 1e-4
    assert numbers["raster_ratio"] > 3.0
