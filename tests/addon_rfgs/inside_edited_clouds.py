# SPDX-License-Identifier: Apache-2.0
"""Clouds written back and compared with meshes; `test_inside_blender.py` runs this file."""

from __future__ import annotations

from pathlib import Path

import bpy
import mathutils
import numpy as np
import pytest
from blank_file import open_blank_file
from plyfile import PlyData
from splat_files import COLUMNS, REST, rows_of, write
from splat_scene import FRAMES, cloud, only_cloud

from addon_rfgs.gaussians import attributes
from addon_rfgs.gaussians.compare import compare_with_mesh
from addon_rfgs.timing import curve_lists

pytestmark = pytest.mark.usefixtures("registered")


def move_points(mesh: bpy.types.Mesh, rows: list[int], shift: float) -> None:
    for row in rows:
        mesh.vertices[row].co.x += shift


@pytest.mark.parametrize("form", ["little", "big", "text"])
def test_an_edited_cloud_is_written_back_without_loss(tmp_path: Path, form: str) -> None:
    kinds = {"label": "u4", "red": "u1", "time": "f8"}
    names = ["label", *COLUMNS, *REST, "red", "time", "custom"]
    rows = rows_of(names, 30, **kinds)
    rows["nx"][3], rows["custom"][4] = np.nan, -np.inf
    rows["label"][5] = 2**32 - 1
    item = only_cloud(write(tmp_path / "in.ply", rows, form))
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    for row in (0, 7, 29):
        item.data.vertices[row].select = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    move_points(item.data, [2], 1.5)
    out = tmp_path / "out.ply"
    assert bpy.ops.rfgs.export_gaussians(filepath=str(out)) == {"FINISHED"}
    kept = np.delete(rows, [0, 7, 29])
    kept["x"][2] += np.float32(1.5)
    back = PlyData.read(str(out))["vertex"].data
    assert back.dtype.names == kept.dtype.names
    for name in names:
        assert back[name].tobytes() == kept[name].tobytes(), name


def test_transforms_of_the_object_are_written(tmp_path: Path) -> None:
    rows = rows_of(COLUMNS, 12)
    item = only_cloud(write(tmp_path / "in.ply", rows))
    out = tmp_path / "out.ply"
    item.location = (1.0, -2.0, 0.5)
    bpy.ops.rfgs.export_gaussians(filepath=str(out))
    moved = PlyData.read(str(out))["vertex"].data
    np.testing.assert_allclose(moved["y"], rows["y"] - 2, rtol=1e-6, atol=1e-6)
    for name in set(COLUMNS) - {*"xyz"}:
        assert moved[name].tobytes() == rows[name].tobytes(), name
    item.rotation_euler, item.scale = (0.4, -1.0, 2.0), (3.0, 3.0, 3.0)
    bpy.ops.rfgs.export_gaussians(filepath=str(out))
    turned = only_cloud(out)
    rotation = np.array(mathutils.Euler((0.4, -1.0, 2.0)).to_matrix())

    def covariances(quats: np.ndarray, scales: np.ndarray) -> np.ndarray:
        matrices = [np.array(mathutils.Quaternion(quat).to_matrix()) for quat in quats]
        return np.stack([m @ np.diag(s**2) @ m.T for m, s in zip(matrices, scales, strict=True)])

    before = covariances(
        np.stack([rows[f"rot_{i}"] for i in range(4)], 1)
        / np.linalg.norm(np.stack([rows[f"rot_{i}"] for i in range(4)]), axis=0)[:, None],
        np.exp(np.stack([rows[f"scale_{i}"] for i in range(3)], 1)),
    )
    after = covariances(
        attributes.get(turned.data, "rotation"), attributes.get(turned.data, "scale")
    )
    np.testing.assert_allclose(after, 9 * rotation @ before @ rotation.T, rtol=1e-4, atol=1e-4)
    places = np.stack([rows[axis] for axis in "xyz"], 1) @ rotation.T * 3 + [1.0, -2.0, 0.5]
    np.testing.assert_allclose(attributes.positions(turned.data), places, atol=1e-4)


@pytest.mark.parametrize(
    ("change", "names", "message"),
    [
        (lambda item: setattr(item, "scale", (1, 2, 1)), COLUMNS, "scaled unequally"),
        (lambda item: setattr(item, "scale", (-1, 1, 1)), COLUMNS, "mirrored"),
        (lambda item: setattr(item, "rotation_euler", (1, 0, 0)), [*COLUMNS, *REST], "f_rest"),
        (
            lambda item: item.data.attributes.remove(item.data.attributes["ply_opacity"]),
            COLUMNS,
            "ply_opacity is gone",
        ),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path: Path, change, names, message: str) -> None:
    item = only_cloud(write(tmp_path / "in.ply", rows_of(names, 4)))
    change(item)
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.rfgs.export_gaussians(filepath=str(tmp_path / "out.ply"))
    with pytest.raises(RuntimeError, match=r"ending in \.ply"):
        bpy.ops.rfgs.export_gaussians(filepath=str(tmp_path / "out.txt"))
    assert [path.name for path in tmp_path.iterdir()] == ["in.ply"]


def test_centimetre_scenes_write_metres_bit_for_bit(tmp_path: Path) -> None:
    rows = rows_of(COLUMNS, 9)
    write(tmp_path / "in.ply", rows)
    open_blank_file()
    bpy.context.scene.unit_settings.scale_length = 0.01
    bpy.context.scene.rfgs.gaussians.path = str(tmp_path / "in.ply")
    bpy.ops.rfgs.import_gaussians()
    bpy.ops.rfgs.export_gaussians(filepath=str(tmp_path / "out.ply"))
    assert (tmp_path / "out.ply").read_bytes() == (tmp_path / "in.ply").read_bytes()


def test_distances_to_a_moving_sphere(settings) -> None:
    """A sphere that moves with the frames: each cloud is measured where the sphere then is."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 10
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6, radius=2.0)
    ball = bpy.context.object
    for frame in (1, 10):
        ball.location.x = 0.5 * frame
        ball.keyframe_insert("location", frame=frame)
    for curve in (curve for rows in curve_lists(ball.animation_data.action) for curve in rows):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    scene.frame_set(3)
    assert bpy.ops.rfgs.compare_gaussians(every_frame=True) == {"FINISHED"}
    assert scene.frame_current == 3 and settings.color_by == "ERROR"
    for frame in FRAMES:
        places = attributes.positions(cloud(frame).data)
        expected = np.abs(np.linalg.norm(places - [0.5 * frame, 0, 0], axis=1) - 2)
        got = attributes.get(cloud(frame).data, "error_m")
        np.testing.assert_allclose(got, expected, atol=3e-3)
    settings.opacity_threshold = 0.6
    visible_ones = attributes.get(cloud(2).data, "opacity") >= 0.6
    found = compare_with_mesh(scene, [cloud(2)], settings.display(), [ball])
    expected = np.abs(np.linalg.norm(attributes.positions(cloud(2).data) - [1.5, 0, 0], axis=1) - 2)
    assert found.count == visible_ones.sum()
    assert found.mean_m == pytest.approx(expected[visible_ones].mean(), abs=3e-3)
    assert found.median_m == pytest.approx(np.median(expected[visible_ones]), abs=3e-3)


def test_comparing_without_a_mesh_says_so(settings) -> None:
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
    bpy.context.scene.frame_set(2)
    with pytest.raises(RuntimeError, match="no mesh moves"):
        bpy.ops.rfgs.compare_gaussians()
    settings.compare_with = "SELECTED"
    with pytest.raises(RuntimeError, match="select meshes"):
        bpy.ops.rfgs.compare_gaussians()
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.hide_render = True
    with pytest.raises(RuntimeError, match="no faces that render"):
        bpy.ops.rfgs.compare_gaussians()
