# SPDX-License-Identifier: GPL-3.0-or-later
"""Radio devices inside Blender; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon_rfgs.cli import open_blend, run
from addon_rfgs.devices import authoring, empties, layout, overlay, placement
from addon_rfgs.devices.sketch import joined, sketch
from addon_rfgs.errors import AddonError
from addon_rfgs.scene.cameras import find_devices
from addon_rfgs.scene.enclosure import enclosed
from addon_rfgs.tables import RADIO_FIELDS, RADIOS
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, place_devices, preset
from rfgs_core.radio import check as factory_check
from rfgs_core.radio import layout as factory_layout

pytestmark = pytest.mark.usefixtures("in_room")


@pytest.mark.parametrize("name", RADIOS)
@pytest.mark.parametrize("role", ["ACCESS_POINT", "TRANSMITTER", "RECEIVER"])
def test_elements_are_where_the_factory_has_them(name: str, role: str) -> None:
    rng = np.random.default_rng(7)
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    place = rng.normal(size=3)
    item = empties.add_device(
        *(bpy.context.scene, "x", role, name, np.eye(4), RADIO_FIELDS[name]),
    )
    item.location, item.rotation_mode = place, "QUATERNION"
    item.rotation_quaternion, item.scale = turn, (2, 3, 0.5)
    bpy.context.view_layer.update()
    pose = empties.pose_of(item, 1.0)
    device = DevicePose("x", tuple(map(float, place)), tuple(map(float, turn)), role)
    expected = factory_layout(preset(name), [device])
    for array in ("tx", "rx"):
        theirs = getattr(expected, f"{array}_xyz")
        ours = layout.world_elements(empties.radio_fields(item), array, pose)
        if array in layout.arrays_of(role):
            np.testing.assert_allclose(ours, theirs, atol=1e-6)
        else:
            assert len(theirs) == 0


def test_spacing_counts_in_wavelengths_too() -> None:
    rf = bpy.data.objects["ap"].rfgs.rf
    rf.freq_min_ghz, rf.freq_max_ghz = 5.72, 5.88
    wavelength = 299_792_458 / 5.8e9
    assert rf.rx_spacing_m == 0 and rf.rx_spacing_wavelengths == pytest.approx(0.5)
    rf.rx_spacing_wavelengths = 0.8
    assert rf.rx_spacing_m == pytest.approx(0.8 * wavelength, rel=1e-5)
    # Closed form: 8 columns span 7 spacings.
    assert layout.width_m(rf.row()) == pytest.approx(7 * 0.8 * wavelength, rel=1e-4)
    rf.rx_spacing_wavelengths = 0.5
    assert rf.rx_spacing_m == 0, "half a wavelength follows the band"


@pytest.mark.parametrize("name", RADIOS)
def test_placement_is_the_factory_s(name: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        low = rng.uniform(-3, 3, 3)
        bounds = np.stack([low, low + rng.uniform([1, 1, 2.5], [12, 12, 4])])
        try:
            theirs = place_devices(preset(name), bounds)
        except RfgsError:
            with pytest.raises(AddonError):
                placement.spots(name, bounds)
            continue
        ours = placement.spots(name, bounds)
        assert len(ours) == len(theirs)
        for spot, device in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(spot.position_m, device.position_m, atol=1e-12)
            turn = (np.cos(spot.yaw / 2), np.sin(spot.yaw / 2))
            w, _, _, z = device.quat_wxyz
            assert abs(turn[0] * w + turn[1] * z) == pytest.approx(1.0)


def test_inside_means_what_it_means_to_the_factory() -> None:
    rng = np.random.default_rng(5)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1.0)
    sphere = bpy.context.object.data
    vertices = np.array([vertex.co for vertex in sphere.vertices])
    faces = np.array([face.vertices for face in sphere.polygons])
    points = rng.uniform(-1.3, 1.3, (300, 3))
    bounds = np.array([[-4.0, -4, -4], [4, 4, 4]])
    ours = enclosed(points, bounds, vertices, faces)
    np.testing.assert_array_equal(ours, factory_check.enclosed(points, bounds, vertices, faces))
    radius = np.linalg.norm(points, axis=1)
    assert ours[radius < 0.9].all() and not ours[radius > 1.0].any()
    # A room is not furniture.
    assert not enclosed(points, bounds / 3.5, vertices, faces).any()


def test_mirrored_twice_is_where_it_was() -> None:
    item = bpy.data.objects["ap"]
    item.rotation_euler = (0.2, -0.4, 0.9)
    bpy.context.view_layer.update()
    before = empties.pose_of(item, 1.0)
    empties.mirror(item, 0, 0.35, 1.0)
    bpy.context.view_layer.update()
    middle = empties.pose_of(item, 1.0)
    assert np.linalg.det(middle[:3, :3]) == pytest.approx(1.0)
    assert middle[0, 3] == pytest.approx(0.7 - before[0, 3])
    np.testing.assert_allclose(middle[:3, 0], before[:3, 0] * [-1, 1, 1], atol=1e-6)
    # The RX array as a whole is the mirror image of what it was.
    flipped = layout.world_elements(RADIO_FIELDS["wifi"], "rx", before)
    flipped[:, 0] = 0.7 - flipped[:, 0]
    now = layout.world_elements(RADIO_FIELDS["wifi"], "rx", middle)
    assert all(np.linalg.norm(flipped - place, axis=1).min() < 1e-6 for place in now)
    empties.mirror(item, 0, 0.35, 1.0)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(empties.pose_of(item, 1.0), before, atol=1e-6)


def test_buttons_add_place_copy_mirror_and_remove() -> None:
    scene = bpy.context.scene
    ops = bpy.ops.rfgs
    assert ops.add_device(role="RECEIVER", location=(1, 0, 1), rx_cols=3) == {"FINISHED"}
    first = bpy.context.view_layer.objects.active
    assert (first.rfgs.role, first.rfgs.radio, first.rfgs.rf.rx_cols) == ("RECEIVER", "scene", 3)
    # The next is like it.
    ops.add_device(role="TRANSMITTER", location=(0, 1, 1), rotation=(0, 0, pi))
    assert bpy.context.view_layer.objects.active.rfgs.rf.rx_cols == 3
    first.rfgs.rf.power_dbm = 3.5
    assert ops.match_devices(device=first.name) == {"FINISHED"}
    assert len({item.rfgs.rf.power_dbm for item in empties.devices(scene)[1:]}) == 1
    ops.duplicate_device(device=first.name, offset=(0, 0, 0.25))
    twin = bpy.context.view_layer.objects.active
    assert twin != first and tuple(twin.matrix_world.translation) == pytest.approx((1, 0, 1.25))
    ops.mirror_device(axis="Y")
    image = bpy.context.view_layer.objects.active
    middle = authoring.scene_space(scene)[0][:, 1].mean()
    assert image.matrix_world.translation.y == pytest.approx(2 * middle, abs=1e-6)
    names = [item.name for item in empties.devices(scene)]
    assert ops.place_radio(radio="mmwave") == {"FINISHED"}
    assert ops.place_radio(radio="mmwave") == {"FINISHED"}, "again: replaced, not doubled"
    placed = [item for item in empties.devices(scene) if item.name not in names]
    assert [item.name for item in placed] == [f"mmwave_{index}" for index in range(4)]
    assert all(item.select_get() for item in placed)
    assert ops.remove_device() == {"FINISHED"}
    assert [item.name for item in empties.devices(scene)] == names
    with pytest.raises(RuntimeError, match="no radio device is selected"):
        ops.remove_device()
    rows, _ = find_devices(scene)
    assert {row["name"] for row in rows} == set(names)


def test_around_a_selection() -> None:
    for item in bpy.context.selected_objects:
        item.select_set(False)
    bpy.data.objects["crate"].select_set(True)
    bpy.ops.rfgs.place_radio(radio="wifi_commodity", around="SELECTION", margin_m=1.0)
    places = np.array([item.location for item in bpy.context.selected_objects])
    # The crate and its mirror image span x of 0.7 to 1.7 m; 1 m of margin, 0.2 m of inset.
    assert places[:, 0].min() == pytest.approx(0.7 - 0.8, abs=1e-5)
    assert places[:, 0].max() == pytest.approx(1.7 + 0.8, abs=1e-5)
    assert sorted(places[:, 2]) == pytest.approx([1.2, 1.2, 2.2, 2.2], abs=1e-5)


def test_scenes_in_other_units_are_placed_in_metres() -> None:
    scene = bpy.context.scene
    bounds, meshes, _ = authoring.scene_space(scene)
    space = bounds, meshes, None
    expected = authoring.place_radio(scene, "wifi", space, keep=False)
    places = {item.name: empties.pose_of(item, 1.0) for item in expected}
    scene.unit_settings.scale_length = 0.01
    authoring.place_radio(scene, "wifi", space, keep=False)
    bpy.context.view_layer.update()
    for item in empties.devices(scene):
        if item.name in places:
            np.testing.assert_allclose(empties.pose_of(item, 0.01), places[item.name], atol=1e-5)
            assert np.abs(item.location).max() > 100


def test_the_list_knows_the_active_device() -> None:
    settings = bpy.context.scene.rfgs.devices
    bpy.context.view_layer.objects.active = bpy.data.objects["crate"]
    assert settings.active == -1
    settings.active = bpy.data.objects.find("ap")
    assert bpy.context.view_layer.objects.active.name == "ap"
    assert bpy.data.objects["ap"].select_get() and not bpy.data.objects["crate"].select_get()


def say(*words: str) -> int:
    """Runs a command on the open file."""
    return run(["devices", *words])


def test_a_radio_of_one_s_own_by_commands(tmp_path: Path, capfd: pytest.CaptureFixture) -> None:
    bpy.data.objects.remove(bpy.data.objects["ap"])
    out = str(tmp_path / "own.blend")
    array = ("--tx", "1x2", "--rx", "2x4", "--rx-spacing-wavelengths", "0.7", "--pattern", "dipole")
    band = ("--band-ghz", "2.4", "2.48", "--power-dbm", "11", "--look-at", "0", "0", "1.2")
    add = ("add", "access-point", "--name", "box", "--at", "1", "-1.5", "1.2")
    assert say(*add, *array, *band, "--out", out) == 0
    # Another is like it without being told, and its mirror image too.
    assert say("add", "transmitter", "--at", "0", "1", "1.2", "--out", out) == 0
    assert say("mirror", "box", "--axis", "x", "--out", out) == 0
    assert say("duplicate", "box", "--out", out) == 0
    assert say("remove", "box.002", "--out", out) == 0
    open_blend(Path(out))
    assert say("list", "--json", str(tmp_path / "own.json")) == 0
    assert capfd.readouterr().out.count("looks along") == 3
    rows = json.loads((tmp_path / "own.json").read_text())
    assert [row["role"] for row in rows] == ["ACCESS_POINT", "ACCESS_POINT", "TRANSMITTER"]
    same = ("freq_min_hz", "tx_cols", "rx_cols", "rx_spacing_m", "pattern", "power_dbm")
    assert len({tuple(row[name] for name in same) for row in rows}) == 1
    assert rows[0]["rx_spacing_m"] == pytest.approx(0.7 * 299792458 / 2.44e9, abs=1e-6)
    middle = authoring.scene_space(bpy.context.scene)[0][:, 0].mean()
    np.testing.assert_allclose(rows[1]["position_m"], [2 * middle - 1, -1.5, 1.2], atol=1e-5)
    np.testing.assert_allclose(
        rows[1]["boresight"], np.multiply(rows[0]["boresight"], [-1, 1, 1]), atol=1e-5
    )


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (("remove", "app"), "no radio device 'app'; did you mean 'ap'?"),
        (("add", "receiver", "--at", "0", "0", "1", "--rx", "3by4"), "expected ROWSxCOLS"),
        (("add", "receiver", "--at", "0", "0", "1", "--band-ghz", "3", "2"), "FROM < TO"),
        (("preset", "wifi", "--around", "flor"), "did you mean 'floor'"),
        (("preset", "uwb", "--around", "crate", "--margin-m", "0"), "do not fit along walls"),
        (("preset", "wify"), "invalid choice"),
    ],
)
def test_mistakes_get_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture, task: tuple[str, ...], words: str
) -> None:
    assert say(*task, "--out", str(tmp_path / "never.blend")) == 2
    said = capfd.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and words in said, said
    assert not list(tmp_path.iterdir())


def test_help_is_printed(capfd: pytest.CaptureFixture) -> None:
    assert say("add", "--help") == 0
    assert "--rx-spacing-wavelengths" in capfd.readouterr().out


@pytest.mark.parametrize("role", ["ACCESS_POINT", "TRANSMITTER", "RECEIVER"])
def test_the_overlay_is_to_scale(role: str) -> None:
    fields = {**RADIO_FIELDS["wifi"], "rx_spacing_m": 0.04}
    pose = placement.Spot((1.0, 2.0, 3.0), pi / 2).pose()
    lines = sketch(fields, role, pose)
    for array, count in (("tx", 1), ("rx", 64)):
        squares = getattr(lines, array).reshape(-1, 4, 2, 3)
        if array not in layout.arrays_of(role):
            assert len(squares) == 0
            continue
        assert len(squares) == count
        # Each square closes around its element, in the plane across the boresight.
        np.testing.assert_allclose(squares[:, :, 1], np.roll(squares[:, :, 0], -1, axis=1))
        elements = layout.world_elements(fields, array, pose)
        np.testing.assert_allclose(squares.mean(axis=(1, 2)), elements, atol=1e-12)
        assert np.ptp(squares[..., 1]) == pytest.approx(0), "boresight is +y"
    if role != "TRANSMITTER":
        side = np.linalg.norm(lines.rx[0, 1] - lines.rx[0, 0])
        assert 0 < side < 0.04, "neighbours do not touch"
    start, tip = lines.boresight[0]
    np.testing.assert_allclose((tip - start) / np.linalg.norm(tip - start), [0, 1, 0], atol=1e-12)
    origin = [1, 2, 2.7] if role == "TRANSMITTER" else [1, 2, 3]
    np.testing.assert_allclose(start, origin, atol=1e-12)
    np.testing.assert_allclose(lines.boresight[1:, 1], np.tile(tip, (4, 1)))
    both = joined([lines, lines])
    assert len(both.boresight) == 2 * len(lines.boresight)


def test_nothing_is_drawn_without_a_window() -> None:
    assert bpy.app.background and not overlay._handles


def recorded(folder: Path, **changes: object) -> Path:
    """A dataset's description of two devices, as `rfgs import` writes it."""
    radio = {"name": "intel", "freq_min_hz": 5.816e9, "freq_max_hz": 5.834e9}
    radio |= {"num_subcarriers": 57, "tx_rows": 1, "tx_cols": 2, "rx_rows": 1, "rx_cols": 3}
    radio |= {"rx_spacing_m": 0.03, "own_device_links": "excluded", "tx_offset_m": [0.0, 0.0, 0.0]}
    rows = [
        {"name": "tx", "role": "TRANSMITTER", "position_m": [0, 0, 1], "quat_wxyz": [1, 0, 0, 0]},
        {"name": "rx", "role": "RECEIVER", "position_m": [3, 0, 2], "quat_wxyz": [0, 0, 0, 2]},
    ]
    info = {"frames": [1], "radios": {"intel": radio}, "devices": {"intel": rows}, **changes}
    (folder / "lab").mkdir(parents=True, exist_ok=True)
    (folder / "lab" / "sequence.json").write_text(json.dumps(info))
    return folder


def test_devices_of_a_dataset_stand_where_it_has_them(tmp_path: Path) -> None:
    recorded(tmp_path)
    before = set(empties.devices(bpy.context.scene))
    bpy.ops.rfgs.import_devices(directory=str(tmp_path))
    items = {i.name: i for i in set(empties.devices(bpy.context.scene)) - before}
    assert {name: item.rfgs.role for name, item in items.items()} == {
        "tx": "TRANSMITTER",
        "rx": "RECEIVER",
    }
    bpy.context.view_layer.update()
    pose = empties.pose_of(items["rx"], 1.0)
    np.testing.assert_allclose(pose[:3, 3], [3, 0, 2], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 0], [-1, 0, 0], atol=1e-6)
    fields = empties.radio_fields(items["rx"])
    assert (fields["rx_cols"], fields["num_subcarriers"]) == (3, 57)
    assert fields["freq_max_hz"] == pytest.approx(5.834e9) and items["rx"].rfgs.radio == "intel"


@pytest.mark.parametrize(
    ("changes", "radio", "message"),
    [
        ({}, "wifi", "no radio 'wifi'; it has intel"),
        ({"devices": {"intel": [{"name": "x"}]}}, "", "field 'position_m' is missing"),
        ({"devices": {"intel": ["x"]}}, "", r"intel\[0\]: expected an object, found 'x'"),
        ({"devices": {"../x": []}}, "", "'../x' is no name of a radio"),
        ({"devices": {"intel": []}}, "", "0 devices, expected 1 to 2000"),
        ({"devices": 3}, "", "devices: expected an object, found 3"),
    ],
)
def test_damaged_datasets_add_nothing(
    tmp_path: Path, changes: dict, radio: str, message: str
) -> None:
    recorded(tmp_path, **changes)
    before = len(empties.devices(bpy.context.scene))
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.rfgs.import_devices(directory=str(tmp_path), radio=radio)
    assert len(empties.devices(bpy.context.scene)) == before


def test_a_preset_s_name_stays_only_with_the_preset_s_fields(tmp_path: Path) -> None:
    info = json.loads((recorded(tmp_path) / "lab" / "sequence.json").read_text())
    rows = info["devices"]["intel"]
    for fields, label in ((info["radios"]["intel"], "scene"), (dict(RADIO_FIELDS["wifi"]), "wifi")):
        recorded(tmp_path, radios={"wifi": fields}, devices={"wifi": rows[:1]})
        before = set(empties.devices(bpy.context.scene))
        bpy.ops.rfgs.import_devices(directory=str(tmp_path))
        (item,) = set(empties.devices(bpy.context.scene)) - before
        assert item.rfgs.radio == label
