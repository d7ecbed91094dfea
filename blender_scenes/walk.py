# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns a gait into keyframes of an ordinary action."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from blender_scenes.body import Body
from blender_scenes.gait import Gait, Legs, facing, feet_at, pelvis_at, solve_leg
from blender_scenes.rotations import about, about_x, about_y, about_z, frame_between
from blender_scenes.walk_path import ArcPath

_SIDES = ("L", "R")
_SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01")

#: World rotation of some bones, and where the pelvis is [m].
Pose = tuple[dict[str, np.ndarray], np.ndarray]


def legs_of(body: Body) -> Legs:
    """Rest joints of both legs."""

    def pair(bone: str) -> np.ndarray:
        return np.stack([body.head(f"{bone}.{side}") for side in _SIDES])

    heels = []
    for side, sign in zip(_SIDES, (1, -1), strict=True):
        low = (body.vertices[:, 2] < 0.012) & (body.vertices[:, 0] * sign > 0)
        low &= body.share(f"foot.{side}") > 0.5
        rearmost = body.vertices[low][body.vertices[low][:, 1].argmax()]
        heels.append([rearmost[0], rearmost[1] - 0.015, 0.0])
    return Legs(
        root=body.head("root"),
        hip=pair("upperleg01"),
        knee=pair("lowerleg01"),
        ankle=pair("foot"),
        toe=pair("toe1-1"),
        heel=np.array(heels),
    )


def walking_pose(gait: Gait, body: Body, legs: Legs, path: ArcPath, time_s: float) -> Pose:
    """The walking pose at `time_s` [s]."""
    feet = feet_at(gait, legs, path, time_s)
    root, pelvis = pelvis_at(gait, legs, path, time_s)
    turns = {"root": pelvis}
    for index, side in enumerate(_SIDES):
        thigh, shin, _ = solve_leg(legs, index, root, pelvis, feet)
        turns[f"upperleg01.{side}"], turns[f"lowerleg01.{side}"] = thigh, shin
        turns[f"foot.{side}"], turns[f"toe1-1.{side}"] = feet.foot[index], feet.toes[index]
    _trunk(turns, gait, path, time_s)
    for side in _SIDES:
        _arm(turns, gait, body, side, time_s)
        _fingers(turns, body, side)
    return turns, root


def _trunk(turns: dict[str, np.ndarray], gait: Gait, path: ArcPath, time_s: float) -> None:
    """Turns the chest against the pelvis and keeps the head on the path."""
    cycle = 2 * np.pi * gait.phase(time_s)
    s = gait.travelled(time_s)
    heading = float(path.heading(s))
    chest_yaw = 0.75 * gait.pelvis_yaw_rad * np.cos(cycle)
    pelvis_yaw = -gait.pelvis_yaw_rad * np.cos(cycle)
    roll = gait.pelvis_list_rad * np.cos(cycle - np.pi * gait.stance)
    for index, bone in enumerate(_SPINE):
        share = (index + 1) / len(_SPINE)
        yaw = pelvis_yaw + share * (chest_yaw - pelvis_yaw)
        lean = gait.lean_rad * (0.5 + 0.5 * share)
        turns[bone] = facing(heading + yaw) @ about_y((1.3 * share - 1) * roll) @ about_x(lean)
    # Eyes go where the feet will be in a second; breathing keeps the neck from looking frozen.
    ahead = float(path.heading(s + gait.speed_m_s))
    nod = 0.02 * np.cos(2 * cycle)
    turns["neck01"] = facing(0.5 * (heading + ahead) + 0.3 * chest_yaw) @ about_x(gait.lean_rad)
    turns["head"] = facing(ahead) @ about_x(0.05 + nod)


def _arm(turns: dict[str, np.ndarray], gait: Gait, body: Body, side: str, time_s: float) -> None:
    """Swings an arm with the opposite leg; the elbow bends as the arm comes forward."""
    sign = 1.0 if side == "L" else -1.0
    # The left arm is foremost as the right heel strikes, half a cycle after the left one.
    swing = -sign * np.cos(2 * np.pi * gait.phase(time_s) - 0.25)
    chest = turns["spine01"]
    clavicle = chest @ about_z(0.03 * swing * -sign) @ about_y(0.05 * sign)
    forward, bend = 0.07 + 0.33 * swing, 0.36 + 0.17 * swing
    upper = _hanging(forward, 0.19 * sign)
    fore = _hanging(forward + bend, -0.02 * sign)
    joints = [body.head(f"{name}.{side}") for name in ("upperarm01", "lowerarm01", "wrist")]
    rest_upper, rest_fore = joints[1] - joints[0], joints[2] - joints[1]
    rest_hinge, hinge = np.cross(rest_upper, rest_fore), np.cross(upper, fore)
    turns[f"clavicle.{side}"] = clavicle
    turns[f"upperarm01.{side}"] = chest @ frame_between(rest_upper, rest_hinge, upper, hinge)
    turns[f"lowerarm01.{side}"] = chest @ frame_between(rest_fore, rest_hinge, fore, hinge)


def _hanging(forward_rad: float, outward_rad: float) -> np.ndarray:
    """Direction of a limb that hangs, raised forwards and to +x."""
    return about_y(-outward_rad) @ about_x(-forward_rad) @ np.array([0.0, 0.0, -1.0])


def _fingers(turns: dict[str, np.ndarray], body: Body, side: str) -> None:
    """Curls the fingers a little, as a hand that carries nothing does."""
    hand = turns[f"lowerarm01.{side}"]
    for finger in range(2, 6):
        knuckles = [body.head(f"finger{finger}-{joint}.{side}") for joint in (1, 2, 3)]
        hinge = np.cross(knuckles[1] - knuckles[0], knuckles[2] - knuckles[1])
        curl = hand
        for joint, angle in ((1, 0.22 + 0.03 * finger), (2, 0.35), (3, 0.25)):
            curl = curl @ about(hinge, angle)
            turns[f"finger{finger}-{joint}.{side}"] = curl


def key_walk(
    armature: bpy.types.Object, poses: list[Pose], first_frame: int, label: str
) -> bpy.types.Action:
    """Writes `poses`, one per frame, as keyframes of a new action named `label`."""
    armature.animation_data_create()
    action = bpy.data.actions.new(label)
    armature.animation_data.action = action
    rest = {bone.name: np.array(bone.matrix_local)[:3, :3] for bone in armature.data.bones}
    order = [bone.name for bone in armature.data.bones]
    held: dict[str, np.ndarray] = {}
    for number, (turns, root) in enumerate(poses):
        world: dict[str, np.ndarray] = {}
        for name in order:
            parent = armature.data.bones[name].parent
            above = world[parent.name] if parent else np.eye(3)
            world[name] = turns.get(name, above)
            if name not in turns:
                continue
            local = rest[name].T @ above.T @ world[name] @ rest[name]
            _key(armature, name, local, first_frame + number, held)
        bone = armature.pose.bones["root"]
        bone.location = rest["root"].T @ (root - np.array(bone.bone.head_local))
        bone.keyframe_insert("location", frame=first_frame + number, group="root")
    return action


def _key(
    armature: bpy.types.Object,
    name: str,
    local: np.ndarray,
    frame: int,
    held: dict[str, np.ndarray],
) -> None:
    """Keys one bone's rotation unless it rests where its last key put it."""
    quat = np.array(Matrix(local.tolist()).to_quaternion())
    before = held.get(name)
    if before is not None and before @ quat < 0:
        quat = -quat
    if before is not None and np.abs(before - quat).max() < 1e-5:
        return
    held[name] = quat
    bone = armature.pose.bones[name]
    bone.rotation_quaternion = quat
    bone.keyframe_insert("rotation_quaternion", frame=frame, group=name)
