# SPDX-License-Identifier: Apache-2.0
"""True surfaces, Gaussians and voxels through one camera, in colours that say how far off.

A point's colour is its distance to the true surface, on one scale for everything that is drawn, and
the light comes from the camera: shape is told by the depth of the picture, whatever it is of.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from jaxtyping import Float, Float32
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter
from scipy.spatial import KDTree

from rfgs_core.figures.style import INK, power_colours
from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.render.rasterizer import splat
from rfgs_core.render.side_by_side import to_bytes

#: Distance of the last colour [m].
FARTHEST_M = 0.20
#: Longer side of a picture [px], and the narrowest and widest that it may be for its height.
SIDE_PX, NARROWEST, WIDEST = 320, 0.85, 1.6
#: How far above the horizon the camera stands, and how far off the way that people go across the
#: picture [rad]: seen straight from the side, a long way leaves small people.
ELEVATION, ASIDE = math.radians(20.0), math.radians(50.0)
#: Vertical field of view [rad], and the share of the picture that is left free around the truth.
FIELD_OF_VIEW, MARGIN = math.radians(24.0), 0.08
#: Opacity of points and voxels.
_OPACITY = 0.95
#: Pixels over which depth is smoothed before its slope gives the light.
_SMOOTH_PX = 1.6
#: Light on what is seen edge-on, beside one of what faces the camera.
_AMBIENT = 0.45
#: The drawn grid of the floor is finer than the picture by this factor before it is made smaller.
_FINER = 3


def camera_on(points: Float[np.ndarray, "n 3"], margin: float = MARGIN) -> Camera:
    """A camera that has all points in view and looks across the way that they spread.

    Args:
        points: Points of the true surface in all frames [m].
        margin: Share of the picture that is left free around them.
    """
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    along = np.linalg.svd(flat.T @ flat)[0][:, 0]
    azimuth = math.atan2(along[1], along[0]) + math.pi / 2.0 + ASIDE
    back = np.array(
        [
            math.cos(azimuth) * math.cos(ELEVATION),
            math.sin(azimuth) * math.cos(ELEVATION),
            math.sin(ELEVATION),
        ]
    )
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    axes = np.stack([right, np.cross(back, right), back], axis=1)
    local = (points - centre) @ axes
    tangent = math.tan(FIELD_OF_VIEW / 2.0) * (1.0 - margin)
    # Near enough that the point that needs most room still fits.
    distance_m = float((np.abs(local[:, :2]).max(axis=1) / tangent + local[:, 2]).max())
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, centre + distance_m * back
    slopes = np.abs(local[:, :2] / (distance_m - local[:, 2:])).max(axis=0)
    ratio = float(np.clip(slopes[0] / slopes[1], NARROWEST, WIDEST))
    width, height = (
        (SIDE_PX, round(SIDE_PX / ratio)) if ratio > 1.0 else (round(SIDE_PX * ratio), SIDE_PX)
    )
    focal = (1.0 - margin) * min(0.5 * width / slopes[0], 0.5 * height / slopes[1])
    return Camera("gallery", width, height, focal, focal, width / 2, height / 2, pose)


def as_gaussians(points: Float[np.ndarray, "n 3"], spacing_m: float) -> Gaussians:
    """Round Gaussians at points, so large that points this far apart close to a surface."""
    means = torch.from_numpy(np.asarray(points, dtype=np.float32))
    count = len(means)
    return Gaussians(
        means=means,
        quats=torch.tensor([1.0, 0.0, 0.0, 0.0]).expand(count, 4),
        log_scales=torch.full((count, 3), math.log(0.5 * spacing_m)),
        logit_opacities=torch.full((count,), math.log(_OPACITY / (1.0 - _OPACITY))),
        features=torch.zeros(count, 32),
    )


def draw(
    gaussians: Gaussians,
    surface: Float[np.ndarray, "n 3"],
    camera: Camera,
    floor: Image.Image,
) -> Image.Image:
    """A transparent picture of Gaussians in front of the floor.

    Args:
        gaussians: What is drawn.
        surface: Points of the true surface [m], which colours are told from.
        camera: Where to look from.
        floor: As of `floor_of`.
    """
    off_m = KDTree(surface).query(gaussians.means.numpy())[0] if len(gaussians) else np.zeros(0)
    colours = power_colours()(np.clip(off_m / FARTHEST_M, 0.0, 1.0))[:, :3].astype(np.float32)
    seen = splat(gaussians, torch.from_numpy(np.ascontiguousarray(colours)), camera)
    alpha = seen.alpha.numpy()
    light = _light(seen.depth.numpy(), alpha, camera)
    rgb = seen.rgb.numpy() / np.maximum(alpha, 1e-6)[..., None] * light[..., None]
    picture = Image.fromarray(to_bytes(np.dstack([rgb, alpha])), "RGBA")
    return Image.alpha_composite(floor, picture)


def _light(
    depth: Float32[np.ndarray, "H W"], alpha: Float32[np.ndarray, "H W"], camera: Camera
) -> Float32[np.ndarray, "H W"]:
    """Light from the camera on the surface that the depth tells, 1 where it faces the camera."""
    known = np.where(np.isfinite(depth), depth, 0.0)
    weight = gaussian_filter(alpha, _SMOOTH_PX)
    smooth = gaussian_filter(known * alpha, _SMOOTH_PX) / np.maximum(weight, 1e-6)
    down, across = np.gradient(smooth)
    # Depth per metre across the picture; a pixel is depth / focal length wide.
    slope = np.hypot(down, across) * camera.fl_x / np.maximum(smooth, 1e-6)
    facing = 1.0 / np.sqrt(1.0 + slope**2)
    return (_AMBIENT + (1.0 - _AMBIENT) * facing).astype(np.float32)


def floor_of(bounds_m: Float[np.ndarray, "2 3"], camera: Camera) -> Image.Image:
    """The floor of a scene as lines a metre apart, transparent beside them."""
    low, high = np.asarray(bounds_m, dtype=np.float64)
    size = (camera.width * _FINER, camera.height * _FINER)
    picture = Image.new("RGBA", size, (0, 0, 0, 0))
    pen = ImageDraw.Draw(picture)
    steps = np.linspace(0.0, 1.0, 60)[:, None]
    for axis in (0, 1):
        for at in np.arange(math.ceil(low[axis]), math.floor(high[axis]) + 1):
            ends = np.array([low, high])
            ends[:, 2], ends[:, axis] = low[2], at
            pixels, depth = camera.project(ends[0] + steps * (ends[1] - ends[0]))
            line = [tuple(pixel) for pixel in pixels[depth > 0.2] * _FINER]
            if len(line) > 1:
                pen.line(line, fill=(*_rgb(INK), 110), width=_FINER)
    return picture.resize((camera.width, camera.height), Image.Resampling.LANCZOS)


def _rgb(colour: str) -> tuple[int, int, int]:
    return tuple(bytes.fromhex(colour[1:]))  # type: ignore[return-value]
