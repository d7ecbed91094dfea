# SPDX-License-Identifier: GPL-3.0-or-later
"""From the bones of common human rigs to the 17 joints of RF-GS.

Known by name: MakeHuman and anny (`upperleg01.L`), Mixamo (`mixamorig:LeftUpLeg`), game rigs
(`thigh_l`), Rigify (`DEF-thigh.L`) and CMU (`LeftUpLeg`); others by their shape (`anatomy`). Spines
are taken from the chain of parents between neck and pelvis, because their numbering runs up in
some rigs, down in others.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..tables import JOINTS
from .anatomy import Landmarks, find_body
from .frames import unit_scale
from .limbs import Bone

#: Bone names without side, prefixes and separators, best first, for each limb joint.
_LIMBS = {
    "hip": ("upperleg01", "upleg", "upperleg", "thigh", "hipjoint"),
    "knee": ("lowerleg01", "lowerleg", "calf", "shin", "leg"),
    "ankle": ("foot", "ankle"),
    "shoulder": ("upperarm01", "upperarm", "arm"),
    "elbow": ("lowerarm01", "lowerarm", "forearm", "elbow"),
    "wrist": ("wrist", "hand"),
}
_PELVIS = ("hips", "pelvis", "hip")
_NECK = ("neck01", "neck", "neck1", "spine004")
_HEAD = ("head", "spine006")

_PREFIX = re.compile(r"^(.*:|def-|org-|bip0*1[ _]|bip[ _])", re.IGNORECASE)
_SUFFIX_SIDE = re.compile(r"^(.*?)[ ._-](left|right|l|r)$", re.IGNORECASE)
_PREFIX_SIDE = re.compile(r"^(left|right|[lr][ ._-])(.+)$", re.IGNORECASE)


@dataclass(frozen=True)
class Rig:
    """Where the 17 joints are in one armature."""

    points: tuple[tuple[tuple[str, float], ...], ...]
    """For each joint, (bone, position along it from head 0 to tail 1), to be averaged."""
    segments: dict[str, int]
    """Joint that each bone follows."""

    def joints(self, armature: bpy.types.Object) -> np.ndarray:
        """Joint positions [17, 3] in the world axes of the evaluated `armature`."""
        bones, out = armature.pose.bones, np.zeros((len(JOINTS), 3))
        for index, parts in enumerate(self.points):
            ends = [bones[name].head.lerp(bones[name].tail, along) for name, along in parts]
            out[index] = np.mean(np.array(ends, dtype=np.float64), axis=0)
        matrix = np.array(armature.matrix_world, dtype=np.float64)
        return out @ matrix[:3, :3].T + matrix[:3, 3]


def armature_of(item: bpy.types.Object) -> bpy.types.Object | None:
    """The armature that an object is skinned or parented to."""
    for modifier in item.modifiers:
        if modifier.type == "ARMATURE" and modifier.object is not None and modifier.show_render:
            return modifier.object
    parent = item.parent
    return parent if parent is not None and parent.type == "ARMATURE" else None


def split_name(bone: str) -> tuple[str, str]:
    """Plain lower-case name and side ('left', 'right' or '') of a bone.

    Example:
        >>> split_name("mixamorig:LeftUpLeg"), split_name("upperarm01.R")
        (('upleg', 'left'), ('upperarm01', 'right'))
    """
    name, side = _PREFIX.sub("", bone), ""
    match = _SUFFIX_SIDE.match(name)
    if match:
        name, side = match[1], match[2]
    else:
        match = _PREFIX_SIDE.match(name)
        if match:
            name, side = match[2], match[1]
    side = {"l": "left", "r": "right"}.get(side[:1].lower(), "")
    return re.sub(r"[ ._-]", "", name).lower(), side


def read_rig(armature: bpy.types.Object) -> Rig | None:
    """Finds the 17 joints; None where the bones are not those of a human."""
    found = _by_name(armature) or find_body(*_rest(armature))
    return None if found is None else _rig(armature, found)


def _by_name(armature: bpy.types.Object) -> Landmarks | None:
    """The bones of a known human rig."""
    names = {}
    for bone in armature.data.bones:
        names.setdefault(split_name(bone.name), bone.name)

    def find(choices: tuple[str, ...], side: str = "") -> str | None:
        return next((names[choice, side] for choice in choices if (choice, side) in names), None)

    limbs = {
        f"{side}_{joint}": find(choices, side)
        for side in ("left", "right")
        for joint, choices in _LIMBS.items()
    }
    head = find(_HEAD)
    if head is None or None in limbs.values():
        return None
    found = {joint: (bone, 0.0) for joint, bone in limbs.items() if bone}
    # Tails of heads end at the crown in some rigs, beyond it in others.
    return Landmarks(found, head, find(_NECK), find(_PELVIS))


def _rest(armature: bpy.types.Object) -> tuple[list[Bone], list[np.ndarray]]:
    """Bones at rest in world metres, and what may be up: the world's z, else one of their axes."""
    unit = unit_scale(bpy.context.scene)
    matrix = np.array(armature.matrix_world, dtype=np.float64)

    def place(point: Sequence[float]) -> np.ndarray:
        return (matrix[:3, :3] @ np.array(point, dtype=np.float64) + matrix[:3, 3]) * unit

    bones = [
        Bone(
            bone.name,
            bone.parent.name if bone.parent else "",
            place(bone.head_local),
            place(bone.tail_local),
        )
        for bone in armature.data.bones
    ]
    # Who sleeps may be laid down whole.
    own = [matrix[:3, axis] / max(np.linalg.norm(matrix[:3, axis]), 1e-9) for axis in (2, 1)]
    return bones, [np.array([0.0, 0.0, 1.0]), *own]


def _rig(armature: bpy.types.Object, body: Landmarks) -> Rig:
    """The joints on a body's bones, and which joint every bone follows."""
    points = {joint: (place,) for joint, place in body.limbs.items()}
    hips = points["left_hip"] + points["right_hip"]
    shoulders = points["left_shoulder"] + points["right_shoulder"]
    points["pelvis"] = ((body.pelvis, 0.0),) if body.pelvis else hips
    points["thorax"] = ((body.neck, 0.0),) if body.neck else shoulders
    points["neck"] = ((body.head, 0.0),)
    points["head"] = ((body.head, body.skull),)
    # A limb that ends with its last bone has its last joint at that bone's tail.
    starts = {joint: bone for joint, (bone, along) in body.limbs.items() if along == 0.0}
    segments = {bone: JOINTS.index(joint) for joint, bone in starts.items()}
    named = {"head": body.head, "neck": body.neck, "pelvis": body.pelvis}
    segments |= {bone: JOINTS.index(joint) for joint, bone in named.items() if bone}
    points["spine"] = _spine(armature, body.neck or body.head, points, segments)
    return Rig(tuple(points[joint] for joint in JOINTS), _inherit(armature, segments))


def _spine(
    armature: bpy.types.Object,
    top: str,
    points: dict[str, tuple[tuple[str, float], ...]],
    segments: dict[str, int],
) -> tuple[tuple[str, float], ...]:
    """Spine joint from the chain below `top`; writes the chain's bones into `segments`."""
    bones = armature.data.bones

    def rest(parts: tuple[tuple[str, float], ...]) -> np.ndarray:
        ends = [bones[n].head_local.lerp(bones[n].tail_local, along) for n, along in parts]
        return np.mean(np.array(ends, dtype=np.float64), axis=0)

    low, high = rest(points["pelvis"]), rest(points["thorax"])
    up = (high - low) / max(float(np.sum((high - low) ** 2)), 1e-12)
    best, distance = None, 0.25
    for bone in bones[top].parent_recursive:
        if bone.name in segments:
            continue
        along = float((np.array(bone.head_local) - low) @ up)
        middle = float((0.5 * (np.array(bone.head_local) + np.array(bone.tail_local)) - low) @ up)
        joint = "thorax" if middle > 0.7 else "spine" if middle > 0.2 else "pelvis"
        segments[bone.name] = JOINTS.index(joint)
        if abs(along - 0.5) < distance:
            best, distance = bone.name, abs(along - 0.5)
    return ((best, 0.0),) if best else points["pelvis"] + points["thorax"]


def _inherit(armature: bpy.types.Object, segments: dict[str, int]) -> dict[str, int]:
    """Gives every bone the joint of its nearest known ancestor, the pelvis if there is none."""
    complete = {}
    for bone in armature.data.bones:
        line = (bone, *bone.parent_recursive)
        known = (segments[item.name] for item in line if item.name in segments)
        complete[bone.name] = next(known, JOINTS.index("pelvis"))
    return complete
