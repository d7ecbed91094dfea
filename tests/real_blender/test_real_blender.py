# SPDX-License-Identifier: Apache-2.0
"""The headless path in a real Blender gives what pip's `bpy` gives."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from plyfile import PlyData, PlyElement

from dataset_factory.scene.bundle import read_bundle

pytestmark = pytest.mark.blender

ROOT = Path(__file__).resolve().parents[2]
LIVING_ROOM = ROOT / "blender_scenes" / "living_room_walk.blend"
Run = Callable[..., subprocess.CompletedProcess[str]]
COMMON = ("--frames", "1:9:8", "--resolution", "64", "--cameras", "2")


@pytest.fixture(scope="module")
def blend(python: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The living room, or a small scene of the tests' own."""
    if LIVING_ROOM.is_file():
        return LIVING_ROOM
    folder = tmp_path_factory.mktemp("scenes")
    python(ROOT / "tests" / "addon_rfgs" / "build_scenes.py", folder, must_work=True)
    return folder / "big.blend"


@pytest.fixture(scope="module")
def bundle(blender, blend: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("real") / "bundle"
    done = blender.rfgs(blend, "export", "--out", out, *COMMON)
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def test_blender_is_at_least_5(blender) -> None:
    if int(blender.version.split(".")[0]) < 5:
        pytest.skip(f"Blender {blender.version} ran; 5.0 or newer is what counts")


def test_bundle_equals_pip_bpy_s(python: Run, bundle: Path, blend: Path, tmp_path: Path) -> None:
    export = ("export", "--out", tmp_path / "pip", *COMMON)
    python("-m", "addon_rfgs", "--blend", blend, *export, must_work=True)
    ours, theirs = read_bundle(bundle), read_bundle(tmp_path / "pip")
    for key in ("frames", "fps", "instances", "objects", "materials", "blend_sha256"):
        assert ours.info[key] == theirs.info[key], key
    for name in ("faces", "material", "instance", "segment", "edges"):
        assert np.array_equal(getattr(ours.topology, name), getattr(theirs.topology, name)), name
    for frame in ours.frames:
        first, second = ours.frame(frame), theirs.frame(frame)
        np.testing.assert_allclose(first.vertices, second.vertices, atol=1e-4)
        np.testing.assert_allclose(first.joints, second.joints, atol=1e-4)
        assert first.action.tolist() == second.action.tolist()
    for first, second in zip(ours.static_meshes(), theirs.static_meshes(), strict=True):
        assert first.name == second.name
        np.testing.assert_allclose(first.vertices, second.vertices, atol=1e-4)
        np.testing.assert_array_equal(first.faces, second.faces)
    for first, second in zip(ours.cameras, theirs.cameras, strict=True):
        np.testing.assert_allclose(
            first["world_from_camera"], second["world_from_camera"], atol=1e-4
        )


def test_ground_truth_is_rendered(blender, blend: Path, tmp_path: Path) -> None:
    library = pytest.importorskip("OpenEXR")
    arguments = ("--samples", "2", "--passes", *COMMON)
    done = blender.rfgs(blend, "groundtruth", "--out", tmp_path, *arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    assert [line for line in done.stdout.splitlines() if line.startswith("progress")] == [
        f"progress {index} 4" for index in range(1, 5)
    ]
    seen = 0
    for camera in ("cam00", "cam01"):
        with Image.open(tmp_path / camera / "000009.png") as picture:
            assert picture.mode == "RGBA" and max(picture.size) == 64
        path = tmp_path / camera / "000009.exr"
        channels = library.File(str(path), separate_channels=True).channels()
        index = channels["ViewLayer.IndexOB.X"].pixels
        depth = channels["ViewLayer.Depth.Z"].pixels
        normal = np.stack([channels[f"ViewLayer.Normal.{axis}"].pixels for axis in "XYZ"])
        assert np.isfinite(depth[index > 0]).all()
        np.testing.assert_allclose(np.linalg.norm(normal, axis=0)[index > 0], 1, atol=1e-2)
        seen += int((index == 1).sum())
    assert seen > 30, "the person is in the masks"


def test_gaussians_are_imported(blender, blend: Path, bundle: Path, tmp_path: Path) -> None:
    vertices = read_bundle(bundle).frame(9).vertices[::10]
    names = [*"xyz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    names += [f"scale_{i}" for i in range(3)] + [f"rot_{i}" for i in range(4)]
    rows = np.zeros(len(vertices), [(name, "<f4") for name in names])
    rows["x"], rows["y"], rows["z"] = vertices.T
    rows["opacity"], rows["rot_0"], rows["f_dc_1"] = 4, 1, 1.5
    for i in range(3):
        rows[f"scale_{i}"] = np.log(0.03)
    folder = tmp_path / "run" / "gaussians"
    folder.mkdir(parents=True)
    PlyData([PlyElement.describe(rows, "vertex")]).write(str(folder / "000009.ply"))
    saved, picture = tmp_path / "inspect.blend", tmp_path / "picture.png"
    arguments = ("--out", saved, "--picture", picture, "--resolution", "64", "--mode", "ellipsoids")
    done = blender.rfgs(blend, "import", tmp_path / "run", *arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    assert saved.stat().st_size > 1000
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGB"), int)
    half = pixels.shape[1] // 2
    change = np.abs(pixels[:, :half] - pixels[:, half:]).max(axis=2) > 24
    assert change.sum() > 20, "Gaussians stand in for the person"


def test_gaussians_are_compared_and_come_back_bit_for_bit(
    blender, blend: Path, bundle: Path, tmp_path: Path
) -> None:
    vertices = read_bundle(bundle).frame(9).vertices[::10]
    names = [*"xyz", "opacity", *(f"scale_{i}" for i in range(3))]
    names += [*(f"rot_{i}" for i in range(4)), *(f"f_rest_{i}" for i in range(9)), "custom"]
    rng = np.random.default_rng(0)
    rows = np.zeros(len(vertices), [(name, "<f4") for name in names])
    for name in names:
        rows[name] = rng.normal(size=len(rows))
    rows["x"], rows["y"], rows["z"] = (vertices + np.float32([0, 0, 0.05])).T
    folder = tmp_path / "run"
    folder.mkdir()
    PlyData([PlyElement.describe(rows, "vertex")], byte_order=">").write(str(folder / "000009.ply"))
    saved, back = tmp_path / "inspect.blend", tmp_path / "back.ply"
    look = ("--size", "2", "--solid-view", "--interpolation", "nearest", "--opacity-threshold", "0")
    done = blender.rfgs(blend, "import", folder, "--out", saved, "--compare", *look)
    assert done.returncode == 0, done.stdout + done.stderr
    told = re.search(r"mean ([\d.]+) cm, median ([\d.]+) cm over (\d+)", done.stdout)
    assert told and int(told[3]) == len(rows)
    assert 0 < float(told[2]) <= 5.1, "no point is farther than it was shifted"
    done = blender.rfgs(saved, "export-gaussians", back)
    assert done.returncode == 0, done.stdout + done.stderr
    stored = PlyData.read(str(back))["vertex"].data
    for name in names:
        assert stored[name].tobytes() == rows[name].tobytes(), name


def test_mistakes_get_one_line_and_a_code(blender, blend: Path, tmp_path: Path) -> None:
    done = blender.rfgs(blend, "export", "--out", tmp_path / "b", "--frames", "1:9999")
    errors = [line for line in done.stderr.splitlines() if line.startswith("error:")]
    assert done.returncode == 2 and len(errors) == 1 and "frames" in errors[0]
    assert blender.rfgs(blend, "frobnicate").returncode == 2
    unknown = blender.run("-b", "--command", "rfgs_unknown")
    assert unknown.returncode == 1


def test_without_the_extension_the_command_is_unknown(blender, blend: Path, tmp_path: Path) -> None:
    bare = blender.bare(tmp_path)
    done = bare.rfgs(blend, "export", "--out", tmp_path / "b")
    assert done.returncode == 1 and "nrecognized command" in done.stdout + done.stderr


def test_the_gui_s_panels_and_operators_exist(blender) -> None:
    code = (
        "import bpy; print('have', hasattr(bpy.types, 'RFGS_PT_dataset'), "
        "bpy.ops.rfgs.export_bundle.idname(), bpy.context.scene.rfgs.export.samples)"
    )
    done = blender.run("-b", "--python-expr", code)
    assert "have True RFGS_OT_export_bundle 16" in done.stdout, done.stdout + done.stderr
