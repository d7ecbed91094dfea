# SPDX-License-Identifier: GPL-3.0-or-later
"""Whose bones are a human's, by their shape; `test_inside_blender.py` runs this file."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file
from build_scenes import BONES, box, person
from mathutils import Euler, Matrix, Vector

from addon_rfgs.scene.check import check_scene
from addon_rfgs.scene.rig import read_rig
from addon_rfgs.tables import JOINTS

pytestmark = pytest.mark.usefixtures("registered")

Row = tuple[str, str | None, tuple[float, float, float], tuple[float, float, float]]
Name = Callable[[int, str], str]

#: Joint → bone of the Mixamo skeleton at whose head it is.
AT = {
    **{f"{side.lower()}_{joint}": f"{side}{bone}" for side in ("Left", "Right")
       for joint, bone in (("hip", "UpLeg"), ("knee", "Leg"), ("ankle", "Foot"),
                           ("shoulder", "Arm"), ("elbow", "ForeArm"), ("wrist", "Hand"))},
    "pelvis": "Hips", "thorax": "Neck", "neck": "Head",
}  # fmt: skip


def gltf(number: int, name: str) -> str:
    """Names as in figures of glTF files, which number the joints of a limb."""
    for side in ("Left", "Right"):
        if name.startswith(side):
            part = "leg" if "Leg" in name or "Foot" in name else "arm"
            return f"Skeleton_{part}_joint_{side[0]}__{number}_"
    return f"Skeleton_{'neck' if name in ('Neck', 'Head') else 'torso'}_joint_{number}"


def nameless(number: int, _name: str) -> str:
    return "Bone" if number == 0 else f"Bone.{number:03d}"


def renamed(name: Name) -> dict[str, str]:
    """The walking figure of the other tests under other names; returns new name by old."""
    open_blank_file()
    bpy.context.scene.frame_end = 5
    rig, body = person()
    body.rfgs.object_class = "AUTO"
    new = {}
    for number, (bone, *_) in enumerate(BONES):
        new[bone] = name(number, bone)
        rig.data.bones[f"mixamorig:{bone}"].name = new[bone]
    return new


def armature(rows: list[Row]) -> bpy.types.Object:
    """An armature of bones given by name, parent, head and tail [m]."""
    open_blank_file()
    item = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    for name, parent, head, tail in rows:
        bone = item.data.edit_bones.new(name)
        bone.head, bone.tail = head, tail
        bone.parent = item.data.edit_bones[parent] if parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    return item


def figure(**places: tuple[float, float, float]) -> list[Row]:
    """The Mixamo skeleton without its names, some bones ending elsewhere."""
    numbers = {name: nameless(number, name) for number, (name, *_) in enumerate(BONES)}
    return [
        (numbers[name], parent and numbers[parent], head, places.get(name, tail))
        for name, parent, head, tail in BONES
    ]


def place_of(item: bpy.types.Object, joint: str) -> np.ndarray:
    bpy.context.view_layer.update()
    rig = read_rig(item)
    assert rig is not None
    return rig.joints(item)[JOINTS.index(joint)]


@pytest.mark.parametrize("name", [gltf, nameless])
def test_a_walking_figure_with_other_names_is_a_person(name: Name) -> None:
    new = renamed(name)
    report = check_scene(bpy.context.scene)
    (instance,) = report["instances"]
    assert (instance["class"], instance["joints"]) == ("person", "known")
    item = bpy.data.objects["rig"]
    heads = {bone: np.array(item.matrix_world @ item.pose.bones[new[bone]].head) for bone in new}
    for joint, bone in AT.items():
        np.testing.assert_allclose(place_of(item, joint), heads[bone], atol=1e-5, err_msg=joint)
    assert 1.5 < place_of(item, "head")[2] < 1.8
    assert heads["Hips"][2] < place_of(item, "spine")[2] < heads["Neck"][2]
    rig = read_rig(item)
    follows = {bone: JOINTS[rig.segments[new[bone]]] for bone in new}
    assert follows["LeftLeg"] == "left_knee" and follows["RightForeArm"] == "right_elbow"
    assert follows["Spine1"] in ("spine", "thorax") and follows["Head"] == "head"


@pytest.mark.parametrize("turn_deg", [0.0, 70.0, 180.0])
def test_left_is_left_whichever_way_it_looks(turn_deg: float) -> None:
    item = armature(figure())
    item.rotation_euler = Euler((0.0, 0.0, np.radians(turn_deg)))
    for joint, x in (("left_wrist", 0.7), ("right_wrist", -0.7), ("left_ankle", 0.1)):
        assert np.isclose((Euler((0, 0, -np.radians(turn_deg))).to_matrix()
                           @ Vector(place_of(item, joint)))[0], x, atol=1e-5)  # fmt: skip


def test_tails_that_importers_make_up_do_not_matter() -> None:
    ends = {"Head": (0.3, 0.0, 1.55), "LeftHand": (0.7, 0.0, 2.0), "RightHand": (-0.7, 0.4, 1.4)}
    item = armature(figure(**ends))
    np.testing.assert_allclose(place_of(item, "left_wrist"), (0.7, 0.0, 1.4), atol=1e-5)
    # A skull is above where the head begins, wherever its bone ends.
    np.testing.assert_allclose(place_of(item, "head"), (0.0, 0.0, 1.55), atol=1e-5)


def test_figures_in_other_units_or_lying_down_are_people() -> None:
    item = armature(figure())
    item.rotation_euler = (np.pi / 2, 0.0, 0.0)
    bpy.context.view_layer.update()
    assert read_rig(item) is not None
    item = armature(figure())
    item.data.transform(Matrix.Scale(100.0, 4))
    assert read_rig(item) is None, "170 m tall"
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert read_rig(item) is not None


def test_a_dog_and_a_robot_arm_are_no_people() -> None:
    dog: list[Row] = [
        ("root", None, (0, 0.4, 0.55), (0, 0.2, 0.55)),
        ("back", "root", (0, 0.2, 0.56), (0, -0.1, 0.57)),
        ("chest", "back", (0, -0.1, 0.57), (0, -0.35, 0.58)),
        ("throat", "chest", (0, -0.35, 0.58), (0, -0.5, 0.75)),
        ("skull", "throat", (0, -0.5, 0.75), (0, -0.7, 0.78)),
        ("rump", "root", (0, 0.42, 0.55), (0, 0.7, 0.6)),
    ]
    for side, x in (("L", 0.1), ("R", -0.1)):
        for leg, parent, y in (("fore", "chest", -0.3), ("hind", "root", 0.4)):
            high, mid, low = (x, y, 0.5), (x, y + 0.03, 0.28), (x, y, 0.07)
            dog += [
                (f"{leg}_1.{side}", parent, high, mid),
                (f"{leg}_2.{side}", f"{leg}_1.{side}", mid, low),
                (f"{leg}_3.{side}", f"{leg}_2.{side}", low, (x, y - 0.08, 0.02)),
            ]
    assert read_rig(armature(dog)) is None
    robot: list[Row] = [("base", None, (0, 0, 0), (0, 0, 0.4))]
    places = [(0, 0, 0.4), (0, 0, 0.9), (0.4, 0, 1.2), (0.7, 0, 1.1), (0.8, 0, 1.0)]
    for number, (head, tail) in enumerate(pairwise(places)):
        robot.append((f"axis_{number}", robot[-1][0], head, tail))
    for side, y in (("L", 0.05), ("R", -0.05)):
        robot += [
            (f"grip.{side}", "axis_3", (0.8, y, 1.0), (0.85, y, 0.95)),
            (f"tip.{side}", f"grip.{side}", (0.85, y, 0.95), (0.9, y, 0.9)),
        ]
    assert read_rig(armature(robot)) is None


def test_what_is_no_person_says_why_and_what_to_do() -> None:
    item = armature([("a", None, (0, 0, 0), (0, 0, 0.5)), ("b", "a", (0, 0, 0.5), (0, 0, 1.0))])
    bpy.context.scene.frame_end = 3
    thing, crate = box("thing", (0, 0, 0), (0.3, 0.3, 1)), box("crate", (1, 1, 0), (2, 2, 1))
    thing.parent = item
    for row in (item, crate):
        for frame, x in ((1, 0.0), (3, 1.0)):
            row.location.x = x
            row.keyframe_insert("location", frame=frame)
    guesses = check_scene(bpy.context.scene)["guesses"]
    why = {row["object"]: row["why"] for row in guesses if row["what"] == "object_class"}
    assert why["crate"] == "moves, and no armature moves it"
    assert why["thing"] == (
        "skinned to armature 'rig', whose bones are not a human's; if it is a person, say so "
        "(class Person, or --people NAME)"
    )
