# SPDX-License-Identifier: Apache-2.0
"""Splats inside Blender, held against the Gaussian itself; `test_inside_blender.py` runs this."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file
from mathutils import Quaternion
from splat_files import COLUMNS, rows_of, write

pytestmark = pytest.mark.usefixtures("registered")

#: Pixels of a side of the picture of one splat, width that it sees, height of the eye [m].
_SIDE, _WIDTH_M, _HEIGHT_M = 61, 5.0, 5.0


@pytest.mark.parametrize("perspective", [False, True])
@pytest.mark.parametrize("stretched", [(0.5, 0.5, 0.5), (0.7, 0.3, 0.08)])
def test_a_splat_fades_out_as_a_gaussian_does(
    tmp_path: Path, stretched: tuple[float, ...], perspective: bool
) -> None:
    """Rendered over nothing: its alpha is the opacity times the most that each ray meets of it."""
    rows = rows_of(COLUMNS, 1)
    for name in rows.dtype.names:
        rows[name] = 0.0
    rows["opacity"] = np.log(0.8 / 0.2)
    quat = np.array([0.8, 0.3, -0.4, 0.33])
    for axis, value in enumerate(quat / np.linalg.norm(quat)):
        rows[f"rot_{axis}"] = value
    for axis, scale in enumerate(stretched):
        rows[f"scale_{axis}"] = np.log(scale)
    open_blank_file()
    scene = bpy.context.scene
    scene.rfgs.gaussians.display_mode = "splats"
    scene.rfgs.gaussians.path = str(write(tmp_path / "one.ply", rows))
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    alpha = rendered_alpha(tmp_path / "one.png", perspective)
    sigmas = nearest_sigmas(quat, stretched, perspective)
    within = sigmas < 2.8
    assert 100 < within.sum() < within.size, "the picture holds all of it"
    np.testing.assert_allclose(alpha[within], 0.8 * np.exp(-0.5 * sigmas[within] ** 2), atol=0.03)
    assert alpha[sigmas > 3.1].max() < 0.02


def test_many_splats_are_seen_through(tmp_path: Path) -> None:
    """Each takes its share of what comes from behind, however many there are."""
    count, opacity = 60, 0.03
    rows = rows_of(COLUMNS, count)
    for name in rows.dtype.names:
        rows[name] = 0.0
    rows["rot_0"], rows["opacity"] = 1.0, np.log(opacity / (1 - opacity))
    rows["z"] = np.linspace(-2, 2, count)
    for axis in range(3):
        rows[f"scale_{axis}"] = np.log(0.3)
    open_blank_file()
    settings = bpy.context.scene.rfgs.gaussians
    settings.display_mode, settings.path = "splats", str(write(tmp_path / "many.ply", rows))
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    render, near = bpy.context.scene.render, 2 / _SIDE
    render.use_border = True  # The middle alone, and what its filter reaches: 60 layers are slow.
    render.border_min_x = render.border_min_y = 0.5 - near
    render.border_max_x = render.border_max_y = 0.5 + near
    middle = rendered_alpha(tmp_path / "many.png", perspective=False)[_SIDE // 2, _SIDE // 2]
    assert middle == pytest.approx(1 - (1 - opacity) ** count, abs=0.03)


def rendered_alpha(path: Path, perspective: bool) -> np.ndarray:
    """Alpha [_SIDE, _SIDE] of what an eye above the middle sees, bottom row first."""
    scene = bpy.context.scene
    eye = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    eye.data.type, eye.location.z = "PERSP" if perspective else "ORTHO", _HEIGHT_M
    eye.data.ortho_scale, eye.data.angle = _WIDTH_M, 2 * np.arctan(_WIDTH_M / 2 / _HEIGHT_M)
    scene.collection.objects.link(eye)
    scene.camera, scene.render.engine, scene.render.film_transparent = eye, "CYCLES", True
    scene.render.resolution_x = scene.render.resolution_y = _SIDE
    scene.cycles.samples, scene.cycles.device, scene.cycles.use_denoising = 64, "CPU", False
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.zeros(4 * _SIDE * _SIDE, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(_SIDE, _SIDE, 4)[..., 3]


def nearest_sigmas(quat: np.ndarray, scales: tuple[float, ...], perspective: bool) -> np.ndarray:
    """How many standard deviations [_SIDE, _SIDE] each pixel's ray passes a Gaussian at zero.

    The whole ray is sampled, which shares no formula with the shader.
    """
    x, y = np.meshgrid(*[(np.arange(_SIDE) - _SIDE // 2) * _WIDTH_M / _SIDE] * 2)
    depth = np.linspace(-2.5, 2.5, 501)[:, None, None]
    wider = (_HEIGHT_M - depth) / _HEIGHT_M if perspective else np.ones_like(depth)
    on_ray = np.stack([x * wider, y * wider, depth + 0 * x], -1)
    turned = on_ray @ np.array(Quaternion(quat).normalized().to_matrix())
    return np.sqrt(((turned / np.array(scales)) ** 2).sum(-1).min(0))
