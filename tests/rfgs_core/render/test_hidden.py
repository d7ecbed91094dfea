# SPDX-License-Identifier: Apache-2.0
"""What nearer Gaussians hide is left out, and pictures stay as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from rfgs_core.gaussians import Gaussians
from rfgs_core.render.bench import random_cloud
from rfgs_core.render.hidden import LIGHT_MIN, mark_in_sight
from rfgs_core.render.rasterizer import splat
from rfgs_core.render.reference import splat_plain
from rfgs_core.render.tiles import LOOK_FROM, tile_splats

COUNT = LOOK_FROM + 5_000


def crowd(size_px: int = 20, opacity: float | None = None):
    """Gaussians a tenth of a pixel wide and dozens per pixel, random colours, and their camera."""
    cloud, rgb, camera = random_cloud(COUNT, size_px, seed=size_px)
    if opacity is not None:
        logits = torch.full((COUNT,), float(np.log(opacity / (1.0 - opacity))))
        cloud = replace(cloud, logit_opacities=logits)
    return cloud, rgb, camera


def placed(means: list[list[float]], sigma_m: float, opacity: float) -> Gaussians:
    cloud = random_cloud(len(means), 8, seed=1)[0]
    return replace(
        cloud,
        means=torch.tensor(means),
        log_scales=torch.full((len(means), 3), float(np.log(sigma_m))),
        logit_opacities=torch.full((len(means),), float(np.log(opacity / (1.0 - opacity)))),
    )


def test_one_lit_pixel_settles_what_is_seen() -> None:
    light = np.zeros((20, 20))
    light[12, 9] = 2.0 * LIGHT_MIN
    # Centre, inverse covariance, opacity, and the exponent that still counts: a circle of 2 px.
    at = [(9.5, 12.5), (11.4, 12.5), (11.6, 12.5), (11.4, 14.4), (-5.0, 12.5), (9.5, 10.6)]
    splats = np.array([[x, y, 1.0, 0.0, 1.0, 0.5, 2.0] for x, y in at])
    shown = np.zeros(6, np.bool_)
    mark_in_sight(shown, light, splats, np.arange(6))
    # The fourth has the pixel in the square around it, not in its circle.
    assert shown.tolist() == [True, True, False, False, False, True]
    light[12, 9] = 0.5 * LIGHT_MIN
    mark_in_sight(shown, light, splats, np.arange(6))
    assert not shown.any()


@pytest.mark.parametrize("opacity", [None, 0.95, 0.3])
def test_a_crowd_of_random_colours_is_drawn_by_its_nearest(opacity: float | None) -> None:
    cloud, rgb, camera = crowd(17, opacity)
    assert len(tile_splats(cloud, camera, leave_out_hidden=True).rows) < 0.6 * COUNT
    found, exact = splat(cloud, rgb, camera), splat_plain(cloud, rgb, camera)
    np.testing.assert_allclose(found.rgb, exact.rgb, atol=2e-5)
    np.testing.assert_allclose(found.alpha, exact.alpha, atol=2e-5)


def test_near_far_and_alternating_ones_in_one_picture() -> None:
    cloud, _, camera = crowd()
    black_and_white = (torch.arange(COUNT) % 2).float()[:, None].expand(-1, 3)
    # A large one before the crowd, a lone one far beside it, and a bright one that it hides.
    others = [
        placed([[0.25, -4.0, 0.15]], 0.08, 0.5),
        placed([[9.625, 30.0, 16.625]], 0.5, 0.7),
        placed([[0.0, 30.0, 0.0]], 0.1, 0.99),
    ]
    colours = [torch.eye(3)[[row]] for row in range(3)]
    rgb = torch.cat([black_and_white, *colours])
    for one in others:
        cloud = Gaussians.join(cloud, one)
    drawn = tile_splats(cloud, camera, leave_out_hidden=True).rows
    assert len(drawn) < 0.6 * COUNT
    assert {COUNT, COUNT + 1} <= set(drawn) and COUNT + 2 not in drawn
    found, exact = splat(cloud, rgb, camera), splat_plain(cloud, rgb, camera)
    assert float(exact.rgb[..., 1].amax()) > 0.5 and float(exact.rgb[..., 0].amax()) > 0.4
    np.testing.assert_allclose(found.rgb, exact.rgb, atol=2e-5)


def test_two_crowds_one_before_the_other_keep_their_colours() -> None:
    cloud, _, camera = crowd(opacity=0.8)
    half = COUNT // 2
    means = 0.5 * cloud.means
    means[half:, 1] += 20.0
    means[half:, 0] -= 8.0
    rgb = torch.tensor([[1.0, 0.0, 0.0]]).repeat(COUNT, 1)
    rgb[half:] = torch.tensor([0.0, 0.0, 1.0])
    cloud = replace(cloud, means=means)
    found = splat(cloud, rgb, camera)
    exact = splat(cloud, rgb, camera, leave_out_hidden=False)
    assert len(tile_splats(cloud, camera, leave_out_hidden=True).rows) < COUNT
    assert float(exact.rgb[..., 2].amax()) > 0.99
    np.testing.assert_allclose(found.rgb, exact.rgb, atol=LIGHT_MIN)


def test_what_hides_nothing_is_drawn_whole() -> None:
    for size_px, opacity in ((512, None), (20, 1.5 / 255)):
        cloud, _, camera = crowd(size_px, opacity)
        drawn, every = (tile_splats(cloud, camera, leave_out) for leave_out in (True, False))
        assert LOOK_FROM < len(every.rows) == len(drawn.rows)


@pytest.mark.parametrize("asks", ["colours", "means"])
def test_where_gradients_are_wanted_nothing_is_left_out(asks: str, monkeypatch) -> None:
    cloud, rgb, camera = crowd()
    told = []

    def note(gaussians: Gaussians, camera, leave_out_hidden: bool = False):
        told.append(leave_out_hidden)
        return tile_splats(gaussians, camera, leave_out_hidden)

    monkeypatch.setattr("rfgs_core.render.rasterizer.tile_splats", note)
    splat(cloud, rgb, camera)
    (rgb if asks == "colours" else cloud.means).requires_grad_(True)
    splat(cloud, rgb, camera)
    with torch.no_grad():
        splat(cloud, rgb, camera)
    assert told == [True, False, True]
