# SPDX-License-Identifier: Apache-2.0
"""Exported meshes through our cameras against the masks and depths that Blender renders."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from mesh_pictures import MeshPicture, rasterize_mesh
from scipy.ndimage import maximum_filter, minimum_filter

from dataset_factory.scene.bundle import Bundle, read_bundle
from rfgs_core.dataset.pictures import read_exr
from rfgs_core.render.cameras import Camera

pytestmark = pytest.mark.skipif(find_spec("bpy") is None, reason="needs bpy")

FRAMES = (1, 2)


@pytest.fixture(scope="module")
def rendered(
    python: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """Folder with `bundle` and `gt`: a torus over a floor, seen by three unlike cameras."""
    folder = tmp_path_factory.mktemp("cameras")
    scene = str(folder / "cameras.blend")
    python(Path(__file__).with_name("build_camera_scene.py"), scene, must_work=True)
    program = ("-m", "addon_rfgs", "--blend", scene)
    python(*program, "export", "--out", folder / "bundle", must_work=True)
    truth = ("--out", folder / "gt", "--frames", "1:2", "--samples", "1", "--passes")
    python(*program, "groundtruth", *truth, must_work=True)
    return folder


def draw(bundle: Bundle, frame: int, camera: Camera) -> tuple[MeshPicture, np.ndarray]:
    """Static and moving meshes of a frame, and the instance of each pixel."""
    vertices, faces = [bundle.frame(frame).vertices], [bundle.topology.faces]
    instance = [bundle.topology.instance]
    for mesh in bundle.static_meshes():
        faces.append(mesh.faces + sum(len(part) for part in vertices))
        vertices.append(mesh.vertices)
        instance.append(np.zeros(len(mesh.faces), np.int32))
    picture = rasterize_mesh(np.concatenate(vertices), np.concatenate(faces), camera)
    return picture, picture.labels(np.concatenate(instance))


def planes(folder: Path, camera: str, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Instance ids and planar depths [m] that Blender rendered."""
    channels = read_exr(folder / "gt" / camera / f"{frame:06d}.exr")
    found = {}
    for key in ("IndexOB", "Depth"):
        (name,) = [name for name in channels if key in name]
        found[key] = channels[name]
    return found["IndexOB"].round().astype(int), found["Depth"]


def border_of(mask: np.ndarray) -> np.ndarray:
    """Pixels with another value among their eight neighbours."""
    return maximum_filter(mask, 3) != minimum_filter(mask, 3)


def test_masks_and_depths_agree_with_blender(rendered: Path) -> None:
    bundle = read_bundle(rendered / "bundle")
    assert len(bundle.cameras) == 3
    for values in bundle.cameras:
        camera = Camera.from_dict(values)
        for frame in FRAMES:
            picture, drawn = draw(bundle, frame, camera)
            true, depth = planes(rendered, camera.name, frame)
            assert (true > 0).sum() > 400, "the torus fills part of the picture"
            wrong = drawn != true
            border = border_of(true)
            assert wrong.sum() <= 0.01 * (true > 0).sum()
            assert (wrong & border).sum() >= 0.99 * wrong.sum()
            inside = picture.mask & np.isfinite(depth) & ~border & ~border_of(picture.mask)
            assert inside.sum() > 5000
            np.testing.assert_allclose(picture.depth[inside], depth[inside], atol=1e-3)
