# SPDX-License-Identifier: Apache-2.0
"""Tests that need `bpy` in their own process; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import mathutils
import numpy as np
import pytest
from plyfile import PlyData

import addon_rfgs
from addon_rfgs import naming, tables
from addon_rfgs.errors import AddonError
from addon_rfgs.export import bundle, exr
from addon_rfgs.scene import rig, survey
from addon_rfgs.scene.frames import chosen_frames
from addon_rfgs.scene.override_file import read_overrides
from addon_rfgs.scene.overrides import RadioMaterial, first_match


def test_mesh_is_read_back_by_plyfile(tmp_path: Path) -> None:
    vertices = np.arange(12, dtype=np.float32).reshape(4, 3)
    faces = np.array([[0, 1, 2], [2, 1, 3]], np.int32)
    bundle.write_mesh(tmp_path / "m.ply", vertices, faces)
    data = PlyData.read(str(tmp_path / "m.ply"))
    np.testing.assert_array_equal(np.stack([data["vertex"][axis] for axis in "xyz"], 1), vertices)
    np.testing.assert_array_equal(np.vstack(data["face"]["vertex_indices"]), faces)


def test_exr_agrees_with_openexr(tmp_path: Path) -> None:
    library = pytest.importorskip("OpenEXR")
    rng = np.random.default_rng(2)
    planes = {name: rng.normal(size=(37, 23)).astype(np.float32) for name in ("a.Z", "b.X")}
    planes["a.Z"][3, 4] = np.inf
    exr.write_exr(tmp_path / "ours.exr", planes)
    theirs = library.File(str(tmp_path / "ours.exr"), separate_channels=True).channels()
    for name, plane in planes.items():
        np.testing.assert_array_equal(theirs[name].pixels, plane)
    for compression in (library.NO_COMPRESSION, library.ZIPS_COMPRESSION, library.ZIP_COMPRESSION):
        header = {"compression": compression, "type": library.scanlineimage}
        library.File(header, dict(planes)).write(str(tmp_path / "theirs.exr"))
        for name, plane in exr.read_exr(tmp_path / "theirs.exr").items():
            np.testing.assert_array_equal(plane, planes[name])


def test_topologies_differ_by_their_corners_alone() -> None:
    told = []
    for faces in ([(0, 1, 2), (0, 2, 3)], [(0, 1, 3), (1, 2, 3)], [(0, 1, 2), (0, 2, 3)]):
        mesh = bpy.data.meshes.new("square")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], faces)
        told.append(survey._corners(mesh))
        assert np.array(faces, np.int32).tobytes() in told[-1]
    assert told[0] == told[2] != told[1]


def test_names_are_safe_and_unique() -> None:
    names = naming.Names()
    made = [names.unique(text) for text in ("Wall é__1", "Wall_e_1", "Wall é__1", "../x", "")]
    assert len(set(made)) == 5
    assert all("__" not in name and "/" not in name and "." not in name for name in made)


@pytest.mark.parametrize(
    ("bone", "expected"),
    [
        ("upperleg01.L", ("upperleg01", "left")),
        ("mixamorig:RightForeArm", ("forearm", "right")),
        ("lowerarm_r", ("lowerarm", "right")),
        ("DEF-thigh.L", ("thigh", "left")),
        ("Bip01 L Calf", ("calf", "left")),
        ("neck_01", ("neck01", "")),
        ("root", ("root", "")),
        ("lip", ("lip", "")),
    ],
)
def test_bone_names_split_into_name_and_side(bone: str, expected: tuple[str, str]) -> None:
    assert rig.split_name(bone) == expected


def test_every_anny_joint_is_found() -> None:
    bones = {"root": (0, 0.95), "spine05": (0, 1.0), "spine03": (0, 1.2), "neck01": (0, 1.45)}
    bones |= {"head": (0, 1.55)}
    for side, x in (("L", 1), ("R", -1)):
        for name, z in (
            ("upperleg01", 0.9), ("lowerleg01", 0.5), ("foot", 0.1), ("upperarm01", 1.4),
            ("lowerarm01", 1.1), ("wrist", 0.9), ("finger1-1", 0.85), ("clavicle", 1.42),
        ):  # fmt: skip
            bones[f"{name}.{side}"] = (0.2 * x, z)
    chain = {"spine03": "spine05", "neck01": "spine03", "head": "neck01", "spine05": "root"}
    for side in "LR":
        chain |= {f"finger1-1.{side}": f"wrist.{side}", f"clavicle.{side}": "neck01"}
    data = bpy.data.armatures.new("anny")
    item = bpy.data.objects.new("anny", data)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (x, z) in bones.items():
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = (x, 0, z), (x, 0, z + 0.08)
    for child, parent in chain.items():
        data.edit_bones[child].parent = data.edit_bones[parent]
    bpy.ops.object.mode_set(mode="OBJECT")
    found = rig.read_rig(item)
    assert found is not None
    place = dict(zip(tables.JOINTS, found.joints(item), strict=True))
    assert place["left_elbow"] == pytest.approx((0.2, 0, 1.1))
    assert place["right_hip"] == pytest.approx((-0.2, 0, 0.9))
    assert place["pelvis"] == pytest.approx((0, 0, 0.9)), "midpoint of the hips"
    assert place["spine"] == pytest.approx((0, 0, 1.2))
    assert found.segments["finger1-1.R"] == tables.JOINTS.index("right_wrist")
    data.bones["wrist.L"].name = "paw.L"
    assert rig.read_rig(item) is None


@pytest.mark.parametrize("text", ["1", "5:1", "0:3", "1:999", "a:b", "1:5:0"])
def test_bad_frames_are_refused(text: str) -> None:
    with pytest.raises(AddonError, match="frames"):
        chosen_frames(bpy.context.scene, text)


def test_register_and_unregister_leave_nothing() -> None:
    before = set(dir(bpy.types)), set(dir(bpy.types.Object)), set(dir(bpy.ops.rfgs))
    for _ in range(2):
        addon_rfgs.register()
        assert bpy.types.RFGS_PT_object.bl_category == "RF-GS"
        assert bpy.context.scene.rfgs.gaussians.opacity_threshold > 0
        addon_rfgs.unregister()
    assert (set(dir(bpy.types)), set(dir(bpy.types.Object)), set(dir(bpy.ops.rfgs))) == before
    assert not hasattr(bpy.types.Scene, "rfgs") and not hasattr(bpy.types.Material, "rfgs")


def test_material_numbers_do_not_depend_on_the_table() -> None:
    addon_rfgs.register()
    try:
        items = addon_rfgs.properties.RFGS_PG_material.bl_rna.properties[
            "radio_material"
        ].enum_items
        numbers = {item.identifier: item.value for item in items}
    finally:
        addon_rfgs.unregister()
    assert set(numbers) == {"AUTO", *tables.MATERIALS}
    assert len(set(numbers.values())) == len(numbers)
    assert numbers["concrete"] == 1400205171, "files saved earlier would change their meaning"


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"materials": {"Wall": "concret"}}, ["radio material 'concret'", "'concrete'"]),
        ({"materials": {"Wall": {"radio_material": "wood", "thicknes_m": 1}}}, ["'thickness_m'"]),
        ({"fps": -1}, ["fps: expected a number from 0.001 to 32767, got -1"]),
        ({"fps": 40000}, ["fps: expected a number from 0.001 to 32767, got 40000"]),
        ({"unit_scale": 0}, ["unit_scale: expected a number above 0, got 0"]),
        ({"fps": True}, ["fps: expected a number"]),
        ({"frame_range": "9:2"}, ["frame_range: expected FIRST < LAST"]),
        ({"frame_range": 90}, ["frame_range: expected FIRST:LAST"]),
        ({"frame_range": "1:9:2"}, ["frame_range: expected FIRST:LAST"]),
        ({"frame_range": "1_0:20"}, ["frame_range: expected FIRST:LAST"]),
        ({"frame_range": [1.5, 9.5]}, ["frame_range: expected FIRST:LAST"]),
        ({"frame_range": [True, 9]}, ["frame_range: expected FIRST:LAST"]),
        ({"frame_range": {"1": 2, "9": 3}}, ["frame_range: expected FIRST:LAST"]),
        ({"frame_range": [-5, 9]}, ["frame_range: expected frames of 0 to 1048574"]),
        ({"frame_range": "1:2000000"}, ["frame_range: expected frames of 0 to 1048574"]),
        ({"bounds_m": [[0, 0, 0], [1, 1]]}, ["bounds_m: expected 3 numbers"]),
        ({"bounds_m": [[0, 0, 0], [1, -1, 1]]}, ["the lower corner first"]),
        ({"devices": [{"name": "a"}]}, ["devices[0]: position_m is missing"]),
        ({"devices": [{"position_m": [0, 0, 0], "role": "reciever"}]}, ["mean 'RECEIVER'"]),
        ({"devices": [{"name": "a", "position_m": [0, 0, 0]}] * 2}, ["two devices", "'a'"]),
        ({"cameras": {"ring": 0}}, ["1 to 99 cameras, got 0"]),
        ({"room": "cave"}, ["room: expected none, box or material, size_m"]),
        ({"drop": [1]}, ["drop: expected names"]),
    ],
)
def test_senseless_overrides_are_refused_by_key(tmp_path: Path, said: dict, words: list) -> None:
    file = tmp_path / "said.json"
    file.write_text(json.dumps({**said, "label": "scene.yaml"}))
    with pytest.raises(AddonError) as caught:
        read_overrides(file)
    message = str(caught.value)
    assert message.startswith("scene.yaml: ") and all(word in message for word in words), message


def test_devices_look_where_they_are_told(tmp_path: Path) -> None:
    file = tmp_path / "said.json"
    device = {"position_m": [1, 2, 3], "look_at_m": [-2, 4, 0.5]}
    file.write_text(json.dumps({"devices": [device]}))
    (row,) = read_overrides(file).devices
    boresight = mathutils.Quaternion(row["quat_wxyz"]) @ mathutils.Vector((1, 0, 0))
    expected = mathutils.Vector((-3, 2, -2.5)).normalized()
    assert tuple(boresight) == pytest.approx(tuple(expected), abs=1e-6)
    level = mathutils.Quaternion(row["quat_wxyz"]) @ mathutils.Vector((0, 1, 0))
    assert level.z == pytest.approx(0, abs=1e-6)


def test_names_with_brackets_mean_themselves_and_the_first_rule_decides() -> None:
    rules = {"Paint [matt]": RadioMaterial("brick"), "Paint*": RadioMaterial("wood")}
    assert first_match(rules, "Paint [matt]") == RadioMaterial("brick")
    assert first_match(rules, "Paint m") == RadioMaterial("brick")
    assert first_match(rules, "Paint") == RadioMaterial("wood")
    assert first_match(rules, "Stone") is None
