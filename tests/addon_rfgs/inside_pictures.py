# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures are what their cameras saw; `test_inside_blender.py` runs this file."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file
from splat_files import write_run
from splat_scene import FRAMES

from addon_rfgs.export.exr import read_exr
from addon_rfgs.export.groundtruth import render_groundtruth
from addon_rfgs.gaussians.clouds import Inspection, import_gaussians
from addon_rfgs.scene.cameras import _intrinsics, find_views, place_camera
from addon_rfgs.scene.overrides import Overrides


def camera(name: str, turn_z: float = 0.0) -> bpy.types.Object:
    """Five metres south of the origin, level, looking north unless it is turned."""
    item = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    item.location, item.rotation_euler = (0.0, -5.0, 0.0), (0.5 * np.pi, 0.0, turn_z)
    bpy.context.scene.collection.objects.link(item)
    return item


@pytest.fixture
def cube(registered: None) -> bpy.types.Object:
    """A cube that moves a little at the origin, and a camera that looks at it."""
    open_blank_file()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 5
    scene.render.resolution_x, scene.render.resolution_y = 32, 16
    bpy.ops.mesh.primitive_cube_add(size=1.7)
    item = bpy.context.object
    for frame, x in ((1, 0.0), (5, 0.5)):
        item.location.x = x
        item.keyframe_insert("location", frame=frame)
    camera("A")
    return item


def hits(folder: Path, name: str, **asked) -> dict[str, int]:
    """Pixels of each camera in which anything is, of the first frame or the empty picture."""
    scene = bpy.context.scene
    render_groundtruth(scene, folder / name, frames="1:1", resolution=32, samples=1, **asked)
    stem = "empty" if asked.get("empty") else "000001"
    counts = {}
    for place in sorted((folder / name).iterdir()):
        image = bpy.data.images.load(str(place / f"{stem}.png"))
        pixels = np.array(image.pixels[:]).reshape(-1, 4)
        counts[place.name] = int((pixels[:, 3] > 0.5).sum())
        bpy.data.images.remove(image)
    return counts


def test_markers_do_not_choose_the_camera(cube: bpy.types.Object, tmp_path: Path) -> None:
    scene = bpy.context.scene
    camera("B", turn_z=np.pi)
    marker = scene.timeline_markers.new("cut", frame=1)
    marker.camera = bpy.data.objects["A"]
    found = hits(tmp_path, "cut")
    assert found["cam00"] > 20 and found["cam01"] == 0
    assert marker.camera == bpy.data.objects["A"]


@pytest.mark.parametrize("keyed", [False, True])
def test_nobody_is_in_the_empty_room(cube, tmp_path: Path, keyed: bool) -> None:
    if keyed:
        for frame, hidden in ((-20, True), (1, False)):
            cube.hide_render = hidden
            cube.keyframe_insert("hide_render", frame=frame)
    assert hits(tmp_path, "whole")["cam00"] > 20
    assert hits(tmp_path, "empty", empty=True) == {"cam00": 0}
    assert cube.visible_camera and not cube.hide_render


def test_what_is_dropped_is_in_no_picture_though_it_is_keyed(cube, tmp_path: Path) -> None:
    cube.hide_render = False
    cube.keyframe_insert("hide_render", frame=1)
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(3.0, 3.0, 0.0))
    other = bpy.context.object
    for frame, x in ((1, 3.0), (5, 3.5)):
        other.location.x = x
        other.keyframe_insert("location", frame=frame)
    before = hits(tmp_path, "before")["cam00"]
    after = hits(tmp_path, "after", overrides=Overrides(drop=(cube.name,)))["cam00"]
    assert after < before - 20


def test_clouds_of_the_add_on_are_in_no_picture(cube, tmp_path: Path) -> None:
    def seen(name: str) -> tuple[np.ndarray, np.ndarray]:
        hits(tmp_path, name, passes=True)
        channels = read_exr(tmp_path / name / "cam00" / "000001.exr")
        return channels["ViewLayer.Depth.Z"], channels["ViewLayer.IndexOB.X"]

    before = seen("before")
    import_gaussians(bpy.context.scene, write_run(tmp_path / "run", FRAMES), Inspection())
    for one, two in zip(before, seen("after"), strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_lens_that_changes_is_that_of_the_first_frame(cube: bpy.types.Object) -> None:
    scene, item = bpy.context.scene, bpy.data.objects["A"]
    for frame, lens in ((1, 20.0), (5, 80.0)):
        item.data.lens = lens
        item.data.keyframe_insert("lens", frame=frame)
    (view,), guesses = find_views(scene, None, 32)
    assert [row["value"] for row in guesses] == ["lens of frame 1"]
    stand = place_camera(scene, view)
    scene.frame_set(5)
    graph = bpy.context.evaluated_depsgraph_get()
    assert _intrinsics(stand.evaluated_get(graph), 32, 16) == pytest.approx(view.intrinsics)


@pytest.mark.parametrize("scale", [(-1.0, 1.0, 1.0), (1.0, 3.0, 1.0), (2.0, 2.0, 2.0)])
def test_cameras_that_are_mirrored_or_sheared_are_straightened(cube, scale) -> None:
    scene, item = bpy.context.scene, bpy.data.objects["A"]
    above = bpy.data.objects.new("above", None)
    scene.collection.objects.link(above)
    above.scale = scale
    item.parent, item.rotation_euler = above, (1.2, 0.0, 0.6)
    bpy.context.view_layer.update()
    looks = -np.array(item.matrix_world)[:3, 2]
    (view,), guesses = find_views(scene, None, 32)
    axes = view.world_from_camera[:3, :3]
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-6)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(-axes[:, 2], looks / np.linalg.norm(looks), atol=1e-6)
    assert [row["value"] for row in guesses] == ([] if len(set(scale)) == 1 else ["straightened"])
    bpy.context.view_layer.update()
    placed = np.array(place_camera(scene, view).matrix_world)
    np.testing.assert_allclose(placed, view.world_from_camera, atol=1e-5)
