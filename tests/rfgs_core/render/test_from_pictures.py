# SPDX-License-Identifier: Apache-2.0
"""Gaussians from pictures alone, on a ball whose pictures are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.render.cameras import Camera
from rfgs_core.render.from_pictures import PersonView, fit_pictures, visual_hull
from rfgs_core.render.rasterizer import splat

#: The ball, red above its middle and blue below, and where it is looked for [m].
MIDDLE, RADIUS_M = np.array([0.3, -0.2, 1.0]), 0.3
BOUNDS_M = np.array([[-1.0, -1.5, 0.0], [1.5, 1.0, 2.0]])
EDGE_PX, FOCAL_PX, AWAY_M = 64, 100.0, 3.0


def eye(angle_deg: float) -> Camera:
    """Looks at the ball from a circle around it, a little from above."""
    angle, up = np.deg2rad(angle_deg), 0.3
    back = np.array([np.cos(angle), np.sin(angle), up]) / np.hypot(1.0, up)
    right = np.array([-np.sin(angle), np.cos(angle), 0.0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = MIDDLE + AWAY_M * back
    half = EDGE_PX / 2
    return Camera(f"{angle_deg:g}", EDGE_PX, EDGE_PX, FOCAL_PX, FOCAL_PX, half, half, matrix)


def view(angle_deg: float) -> PersonView:
    """What a camera sees of the ball: the nearer crossing of each pixel's ray."""
    camera = eye(angle_deg)
    row, column = np.mgrid[:EDGE_PX, :EDGE_PX] + 0.5
    ray = np.stack([(column - 32) / FOCAL_PX, -(row - 32) / FOCAL_PX, -np.ones_like(row)], axis=-1)
    ray = ray @ camera.world_from_camera[:3, :3].T
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    from_middle = camera.position_m - MIDDLE
    along = ray @ from_middle
    under = along**2 - (from_middle @ from_middle - RADIUS_M**2)
    hit = under > 0.0
    height = (from_middle + (-along - np.sqrt(np.maximum(under, 0.0)))[..., None] * ray)[..., 2]
    colour = np.where((height > 0.0)[..., None], [0.9, 0.1, 0.1], [0.1, 0.2, 0.9])
    return PersonView(camera, np.where(hit[..., None], colour, 0.5).astype(np.float32), hit)


def test_hull_of_a_ball_holds_it_and_little_else() -> None:
    cells = visual_hull([view(angle) for angle in range(0, 360, 30)], BOUNDS_M)
    volume = len(cells) * 0.025**3
    ball = 4.0 / 3.0 * np.pi * RADIUS_M**3
    # A pixel is 3 cm wide there, a tenth of the radius.
    assert 0.85 * ball < volume < 1.35 * ball
    assert np.abs(cells[:, :2].mean(axis=0) - MIDDLE[:2]).max() < 0.01
    assert np.linalg.norm(cells - MIDDLE, axis=1).max() < 1.4 * RADIUS_M


def test_fitted_gaussians_show_the_ball_to_a_camera_that_was_kept_back() -> None:
    seen = [view(angle) for angle in (0, 72, 144, 216, 288)]
    losses: list[float] = []
    fitted = fit_pictures(seen, BOUNDS_M, count=800, steps=100, on_step=losses.append)
    assert len(losses) == 100 and np.mean(losses[-5:]) < 0.1 * np.mean(losses[:5])
    distance = np.linalg.norm(fitted.gaussians.means.numpy() - MIDDLE, axis=1)
    opacity = fitted.gaussians.opacities.numpy()
    assert np.average(distance, weights=opacity) < 1.1 * RADIUS_M
    kept_back = view(36)
    drawn = splat(fitted.gaussians, fitted.rgb, kept_back.camera)
    error = (drawn.over(0.5).numpy() - kept_back.picture)[kept_back.mask]
    assert -10.0 * np.log10(np.mean(error**2)) > 18.0
    covered = drawn.alpha.numpy() > 0.5
    shared = (covered & kept_back.mask).sum() / (covered | kept_back.mask).sum()
    assert shared > 0.9
    red, blue = drawn.rgb[26, 32].numpy(), drawn.rgb[40, 32].numpy()
    assert red[0] > 0.7 > 0.3 > red[2] and blue[2] > 0.7 > 0.3 > blue[0]


def test_same_seed_same_gaussians() -> None:
    seen = [view(0), view(90)]
    first, again, other = (
        fit_pictures(seen, BOUNDS_M, count=50, steps=3, seed=seed).gaussians.means
        for seed in (1, 1, 2)
    )
    assert bool((first == again).all()) and not bool((first == other).all())


def test_one_silhouette_bounds_nothing() -> None:
    with pytest.raises(RfgsError, match="1 pictures: no place lies in the silhouettes of two"):
        fit_pictures([view(0)], BOUNDS_M)
    nobody = [PersonView(eye(a), view(a).picture, np.zeros_like(view(a).mask)) for a in (0, 90)]
    with pytest.raises(RfgsError, match="no place lies in the silhouettes"):
        fit_pictures(nobody, BOUNDS_M)
