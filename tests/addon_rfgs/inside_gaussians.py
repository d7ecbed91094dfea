# SPDX-License-Identifier: Apache-2.0
"""Gaussians inside Blender: shown, coloured, timed; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import colorsys
from pathlib import Path

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file
from splat_files import BARE, COLUMNS, rows_of, write
from splat_scene import FRAMES, cloud

from addon_rfgs.cli import open_blend, run
from addon_rfgs.gaussians import attributes, color_maps
from addon_rfgs.gaussians.coloring import Scale, missing
from addon_rfgs.gaussians.compare import Comparison, keep_result, kept_result
from addon_rfgs.gaussians.display import shown
from addon_rfgs.gaussians.legend import legend_of
from addon_rfgs.gaussians.operators import import_shown

pytestmark = pytest.mark.usefixtures("registered")


def geometry(item: bpy.types.Object):
    if not hasattr(item, "evaluated_geometry"):
        pytest.skip("Blender before 4.5 does not tell what geometry nodes made")
    return item.evaluated_get(bpy.context.evaluated_depsgraph_get()).evaluated_geometry()


def points_shown(item: bpy.types.Object) -> int:
    found = geometry(item)  # Blender frees the points with it
    return len(found.pointcloud.points)


def colors(frame: int) -> np.ndarray:
    return attributes.get(cloud(frame).data, "rfgs_color")[:, :3]


def visible(frame: int) -> list[int]:
    bpy.context.scene.frame_set(frame)
    return [other for other in FRAMES if not cloud(other).hide_render]


def test_radio_arrays_become_attributes(settings) -> None:
    with np.load(Path(settings.path) / "gaussians" / "000005.features.npz") as stored:
        mesh = cloud(5).data
        np.testing.assert_array_equal(attributes.get(mesh, "rf_power_db"), stored["rf_power_db"])
        np.testing.assert_array_equal(attributes.get(mesh, "gid"), stored["track_id"])
        np.testing.assert_array_equal(attributes.get(mesh, "f_31"), stored["features"][:, 31])
        gamma = attributes.get(mesh, "rf_gamma")
        np.testing.assert_array_equal(gamma[:, 0] + 1j * gamma[:, 1], stored["gamma"][:, 0])
        phase = attributes.get(mesh, "rf_phase")
        np.testing.assert_allclose(phase, np.angle(stored["gamma"][:, 0]), rtol=1e-6)


def test_thresholds_size_and_shape_act_on_what_is_already_here(settings) -> None:
    item = cloud(2)
    bpy.context.scene.frame_set(2)
    opacity, power = (attributes.get(item.data, name) for name in ("opacity", "rf_power_db"))
    assert points_shown(item) == 40
    settings.opacity_threshold = 0.5
    assert points_shown(item) == (opacity >= 0.5).sum() == shown(item, settings.display()).sum()
    settings.opacity_threshold, settings.power_threshold_db = 0.0, 35.0
    assert points_shown(item) == (power >= 35).sum() == shown(item, settings.display()).sum()
    settings.size = 2.0
    found = geometry(item)
    assert found.pointcloud.points[0].radius == pytest.approx(0.024)
    settings.display_mode = "ellipsoids"
    graph = bpy.context.evaluated_depsgraph_get()
    scales = sorted(
        max(found.matrix_world.to_scale()) for found in graph.object_instances if found.is_instance
    )
    largest = attributes.get(item.data, "scale").max(axis=1)[power >= 35]
    np.testing.assert_allclose(scales, np.sort(2 * largest), rtol=1e-4)


def test_crop_box_is_an_empty_that_acts_live(settings) -> None:
    item = cloud(2)
    bpy.context.scene.frame_set(2)
    assert bpy.ops.rfgs.add_crop_box() == {"FINISHED"}
    box = settings.crop_box
    assert points_shown(item) == 40, "the box is around all of them"
    box.scale, box.rotation_euler, box.location = (0.8, 0.7, 1.5), (0.3, 0, 0.9), (0.2, 0, 0)
    bpy.context.view_layer.update()
    inverse = np.linalg.inv(np.array(box.matrix_world))
    local = attributes.positions(item.data) @ inverse[:3, :3].T + inverse[:3, 3]
    inside = (np.abs(local) <= 1).all(axis=1).sum()
    assert 0 < inside < 40
    assert points_shown(item) == inside == shown(item, settings.display()).sum()
    settings.use_crop = False
    assert points_shown(item) == 40
    assert bpy.ops.rfgs.add_crop_box() == {"FINISHED"}
    assert settings.crop_box == box, "fitted again"
    bpy.context.view_layer.update()
    assert points_shown(item) == 40


def test_a_crop_box_by_command(settings, tmp_path: Path, capfd: pytest.CaptureFixture) -> None:
    out, words = tmp_path / "cropped.blend", ["import", settings.path, "--out"]
    bounds = ["-0.5", "-0.5", "-2", "0.5", "1", "2"]
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert run([*words, str(out), "--crop", *bounds]) == 0
    open_blend(out)
    found = bpy.context.scene.rfgs.gaussians
    assert found.use_crop and found.crop_box.scale.z == pytest.approx(200)
    bpy.context.view_layer.update()
    inside = shown(cloud(5), found.display())
    places = attributes.positions(cloud(5).data)
    low, high = np.array(bounds, float).reshape(2, 3)
    np.testing.assert_array_equal(inside, ((places > low) & (places < high)).all(axis=1))
    assert 0 < inside.sum() < len(inside)
    never = tmp_path / "never.blend"
    for wrong in ([*bounds[3:], *bounds[:3]], [*bounds[:5], "inf"]):
        assert run([*words, str(never), "--crop", *wrong]) == 2
        assert "X0 < X1" in capfd.readouterr().err and not never.exists()


def test_solid_view_gets_real_meshes_with_an_active_colour(settings) -> None:
    item = cloud(2)
    bpy.context.scene.frame_set(2)
    assert bpy.ops.rfgs.color_solid_view() == {"FINISHED"}
    for mode in ("points", "ellipsoids"):
        settings.display_mode = mode
        mesh = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        assert len(mesh.vertices) == 40 * 6 + 1 and len(mesh.polygons) == 40 * 8
        assert mesh.attributes.active_color.name == "rfgs_color"
        found = attributes.get(mesh, "rfgs_color")[1:].reshape(40, 6, 4)
        np.testing.assert_array_equal(found, np.repeat(found[:, :1], 6, axis=1))
        expected = attributes.get(item.data, "rfgs_color")
        np.testing.assert_allclose(np.sort(found[:, 0, 0]), np.sort(expected[:, 0]), atol=1e-6)


def test_colours_are_what_numpy_says(settings) -> None:
    run = Path(settings.path) / "gaussians"
    stored = {frame: dict(np.load(run / f"{frame:06d}.features.npz")) for frame in FRAMES}
    settings.color_by = "POWER"
    found = colors(5)
    settings.use_range = True
    np.testing.assert_allclose(colors(5), found, atol=1e-5)  # starts as what was found
    settings.use_range = False
    low, high = np.percentile(np.concatenate([s["rf_power_db"] for s in stored.values()]), [5, 99])
    share = np.clip((stored[5]["rf_power_db"] - low) / (high - low), 0, 1) * 4
    expected = np.interp(share, range(5), color_maps.RAMP[:, 1])
    np.testing.assert_allclose(colors(5)[:, 1], expected, atol=1e-5)
    settings.range_low, settings.range_high, settings.use_range = 0.0, 100.0, True
    expected = np.interp(stored[5]["rf_power_db"] / 25, range(5), color_maps.RAMP[:, 0])
    np.testing.assert_allclose(colors(5)[:, 0], expected, atol=1e-5)
    settings.color_by = "PHASE"
    turns = np.mod(np.angle(stored[9]["gamma"][:, 0]) / (2 * np.pi), 1)
    expected = [colorsys.hsv_to_rgb(turn, 0.8, 1.0) for turn in turns]
    np.testing.assert_allclose(colors(9), color_maps.linear(np.array(expected)), atol=1e-5)
    settings.color_by = "ATTRIBUTE"
    settings.color_attribute, settings.use_range = "nx", False
    lightness = colors(2).sum(axis=1)
    assert lightness[attributes.get(cloud(2).data, "ply_nx").argmax()] == lightness.max()


def test_features_have_one_set_of_components_for_all_frames(settings) -> None:
    settings.color_by = "FEATURES"
    tables = [np.load(path)["features"] for path in sorted(Path(settings.path).rglob("*.npz"))]
    joined = np.concatenate(tables).astype(np.float64)
    centred = joined - joined.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    for component in range(3):
        axis = axes[component] * np.sign(axes[component][np.abs(axes[component]).argmax()])
        placed = centred @ axis
        low, high = np.percentile(placed, [5, 99])
        expected = color_maps.linear(np.clip((placed - low) / (high - low), 0, 1))
        got = np.concatenate([colors(frame)[:, component] for frame in FRAMES])
        np.testing.assert_allclose(got, expected, atol=1e-4)


def test_tracks_keep_their_hue(settings) -> None:
    settings.color_by = "TRACK"
    hues = {}
    for frame in FRAMES:
        for track, color in zip(
            attributes.get(cloud(frame).data, "gid"), colors(frame), strict=True
        ):
            np.testing.assert_allclose(hues.setdefault(int(track), color), color)
    assert len(np.unique(np.round(list(hues.values()), 4), axis=0)) == 40


def test_modes_without_their_numbers_say_so(tmp_path: Path) -> None:
    open_blank_file()
    settings = bpy.context.scene.rfgs.gaussians
    settings.path = str(write(tmp_path / "plain.ply", rows_of(BARE, 4)))
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    grey = attributes.get(bpy.data.objects["Gaussians static"].data, "rfgs_color")
    np.testing.assert_allclose(grey[:, :3], color_maps.linear(np.array(0.5)), rtol=1e-5)
    assert missing([bpy.data.objects["Gaussians static"].data], settings.coloring()) is None
    for mode in ("POWER", "PHASE", "FEATURES", "ERROR", "ATTRIBUTE"):
        settings.color_by = mode
        meshes = [bpy.data.objects["Gaussians static"].data]
        assert mode == "POWER" or missing(meshes, settings.coloring())
        with pytest.raises(RuntimeError, match="no Gaussian here"):
            bpy.ops.rfgs.update_display()
        # A setting of the run before is no reason to refuse the next one.
        assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
        again = attributes.get(bpy.data.objects["Gaussians static"].data, "rfgs_color")
        np.testing.assert_array_equal(again, grey)
    assert run(["import", settings.path, "--color-by", "features", "--out", "never.blend"]) == 2


@pytest.mark.parametrize(
    ("interpolation", "expected"),
    [
        ("HOLD", {1: [], 2: [2], 4: [2], 5: [5], 8: [5], 9: [9], 30: [9]}),
        ("NEAREST", {-5: [2], 2: [2], 3: [2], 4: [5], 7: [5], 8: [9], 30: [9]}),
        ("NONE", {1: [], 2: [2], 3: [], 5: [5], 6: [], 9: [9], 10: []}),
    ],
)
def test_clouds_are_keyed_on_the_timeline(settings, interpolation: str, expected: dict) -> None:
    item = cloud(5)
    item.location.x = 3.0
    item.keyframe_insert("location", frame=1)
    settings.interpolation = interpolation
    for offset in (0, 10, -3):
        settings.frame_offset = offset
        for frame, clouds in expected.items():
            assert visible(frame + offset) == clouds, (offset, frame)
            settings.frame_offset = offset  # keyed again at this frame
            seen = [other for other in FRAMES if not cloud(other).hide_viewport]
            assert seen == clouds, "without going to another frame"
    assert item.location.x == 3.0 and item.animation_data.action, "other keys stay"


def test_a_second_import_replaces_the_first_and_keeps_what_a_user_added(settings) -> None:
    mine = bpy.data.objects.new("mine", None)
    bpy.data.collections["RF-GS Gaussians"].objects.link(mine)
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    names = {item.name for item in bpy.data.collections["RF-GS Gaussians"].objects}
    assert names == {"mine", *(f"Gaussians {frame:06d}" for frame in FRAMES)}
    assert len(bpy.data.meshes) == 3
    assert len([group for group in bpy.data.node_groups if "RFGS" in group.name]) == 1


def test_a_static_cloud_without_gaussians_is_not_there(settings) -> None:
    assert import_shown(bpy.context, Path(settings.path)) == ("Imported 120 Gaussians in 3 clouds")


def test_the_legend_says_what_the_colours_mean_with_a_unit(settings) -> None:
    settings.color_by, settings.use_range = "POWER", True
    settings.range_low, settings.range_high = -12.0, 30.0
    legend = legend_of(Scale.of(cloud(5).data))
    assert (legend.title, legend.ends) == ("Reflected power", ("-12 dB", "30 dB"))
    assert legend.colors is not None
    np.testing.assert_allclose(legend.colors[[0, -1]], color_maps.RAMP[[0, -1]])
    settings.color_by = "PHASE"
    legend = legend_of(Scale.of(cloud(5).data))
    assert legend.ends == ("-180 °", "180 °") and legend.colors is not None
    middle = color_maps.hues(np.array([0.0]))[0]
    assert np.abs(legend.colors - middle).sum(axis=1).argmin() in (23, 24), "phase 0"
    settings.color_by = "DISPLAY"
    assert legend_of(Scale.of(cloud(5).data)).ends is None


def test_colours_tell_of_the_radio_unless_others_are_chosen(settings) -> None:
    settings.color_by = "DISPLAY"
    assert np.ptp(colors(5)) > 0.1, "display colours are there, too"
    settings.color_by = "AUTO"
    assert Scale.of(cloud(5).data).mode == "POWER"


def test_power_that_is_the_same_everywhere_is_no_colour(settings) -> None:
    for frame in FRAMES:
        values = cloud(frame).data.attributes["rf_power_db"].data
        values.foreach_set("value", np.full(len(values), 30.0 + frame, np.float32))
    settings.color_by = "DISPLAY"
    settings.color_by = "AUTO"
    assert Scale.of(cloud(5).data).mode == "DISPLAY"
    assert np.ptp(colors(5)) > 0.1


def test_features_colour_what_neither_power_nor_pictures_tell_apart(settings) -> None:
    """A scale of one decibel would show differences that mean nothing."""
    for frame in FRAMES:
        mesh = cloud(frame).data
        powers = np.linspace(30.0, 31.0, len(mesh.vertices), dtype=np.float32)
        mesh.attributes["rf_power_db"].data.foreach_set("value", powers)
        for index in range(3):
            grey = np.zeros(len(mesh.vertices), np.float32)
            mesh.attributes[f"ply_f_dc_{index}"].data.foreach_set("value", grey)
    settings.color_by = "DISPLAY"
    settings.color_by = "AUTO"
    assert Scale.of(cloud(5).data).mode == "FEATURES"
    assert np.ptp(colors(5)) > 0.1
    settings.color_by = "POWER"
    low, high = legend_of(Scale.of(cloud(5).data)).ends or ("", "")
    assert "." in low and "." in high and low != high


def test_a_comparison_is_kept_until_other_gaussians_come(settings) -> None:
    scene = bpy.context.scene
    assert kept_result(scene) == []
    keep_result(scene, Comparison(0.05, 0.031, 40, 1))
    assert kept_result(scene) == ["Median 3.1 cm, mean 5.0 cm", "40 Gaussians in 1 frame"]
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    assert kept_result(scene) == []


def test_an_import_goes_to_a_frame_with_gaussians_and_stays_at_one(settings) -> None:
    scene = bpy.context.scene
    for before, after in ((1, 2), (6, 6), (40, 2)):
        scene.frame_set(before)
        import_shown(bpy.context, Path(settings.path))
        assert scene.frame_current == after


def test_settings_can_be_made_before_there_are_gaussians_and_in_edit_mode(settings) -> None:
    item = cloud(2)
    bpy.context.view_layer.objects.active = item
    bpy.context.scene.frame_set(2)
    bpy.ops.object.mode_set(mode="EDIT")
    settings.color_by = "TRACK"
    with pytest.raises(RuntimeError, match="edit mode"):
        bpy.ops.rfgs.update_display()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.rfgs.update_display() == {"FINISHED"}
    open_blank_file()
    bpy.context.scene.rfgs.gaussians.size = 2.0
    assert not bpy.ops.rfgs.update_display.poll()


def test_an_import_while_a_cloud_is_edited(settings) -> None:
    bpy.context.scene.frame_set(2)
    bpy.context.view_layer.objects.active = cloud(2)
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    assert points_shown(cloud(2)) == 40


def test_units_of_the_scene_are_kept(tmp_path: Path) -> None:
    open_blank_file()
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.01
    scene.rfgs.gaussians.path = str(write(tmp_path / "a.ply", rows_of(COLUMNS, 4)))
    assert bpy.ops.rfgs.import_gaussians() == {"FINISHED"}
    bpy.context.view_layer.update()
    item = bpy.data.objects["Gaussians static"]
    assert item.matrix_world.to_scale()[0] == pytest.approx(100)


def test_a_ply_of_the_import_menu_is_shown_as_the_panel_says(settings, tmp_path: Path) -> None:
    settings.opacity_threshold, before = 1.0, settings.path
    clouds = sorted(item.name for item in bpy.data.collections["RF-GS Gaussians"].objects)
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat")
    for path, words in (("", "no path is set"), (str(tmp_path / "bad.ply"), "bad.ply")):
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.rfgs.import_ply(filepath=path)
    assert settings.path == before
    assert clouds == sorted(item.name for item in bpy.data.collections["RF-GS Gaussians"].objects)
    path = write(tmp_path / "a.ply", rows_of(COLUMNS, 4))
    assert bpy.ops.rfgs.import_ply(filepath=str(path)) == {"FINISHED"}
    (item,) = bpy.data.collections["RF-GS Gaussians"].objects
    assert len(item.data.vertices) == 4 and settings.path == str(path)
    assert points_shown(item) == 0, "none is opaque"
    settings.opacity_threshold = 0.0
    assert points_shown(item) == 4
