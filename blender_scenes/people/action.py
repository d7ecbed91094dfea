# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes poses as keyframes of an ordinary action."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

from blender_scenes.motion.skeleton import Pose


def key_poses(
    armature: bpy.types.Object,
    poses: Sequence[Pose],
    labels: Sequence[str],
    first_frame: int,
    hold: bool = True,
) -> bpy.types.Action:
    """Writes one pose per frame as a new action.

    A pose marker says where each label begins: Blender shows it in the action editor, and the
    add-on reads from it what a person does at each frame.

    Args:
        armature: Who moves.
        poses: Poses of successive frames.
        labels: What the person does at each of them.
        first_frame: Frame of the first pose.
        hold: Keys a bone that has rested once more before it moves on; otherwise it glides
            from its last key, over however many frames that is.

    Returns:
        The action, named after the first label.
    """
    armature.animation_data_create()
    action = bpy.data.actions.new(labels[0])
    armature.animation_data.action = action
    keys = _Keys(armature, hold)
    rest = {bone.name: np.array(bone.matrix_local)[:3, :3] for bone in armature.data.bones}
    order = [bone.name for bone in armature.data.bones]
    for frame, pose in enumerate(poses, start=first_frame):
        world: dict[str, np.ndarray] = {}
        for name in order:
            parent = armature.data.bones[name].parent
            above = world[parent.name] if parent else np.eye(3)
            world[name] = pose.turns.get(name, above)
            if name in pose.turns:
                keys.rotate(name, rest[name].T @ above.T @ world[name] @ rest[name], frame)
        bone = armature.pose.bones[order[0]]
        bone.location = rest[bone.name].T @ (pose.root - np.array(bone.bone.head_local))
        bone.keyframe_insert("location", frame=frame, group=bone.name)
    _mark(action, labels, first_frame)
    return action


def key_breath(skinned: bpy.types.Object, breath: Sequence[float], first_frame: int) -> None:
    """Writes one value per frame for the shape key `breath` of a body."""
    block = skinned.data.shape_keys.key_blocks["breath"]
    for number, value in enumerate(breath):
        block.value = float(value)
        block.keyframe_insert("value", frame=first_frame + number)


def _mark(action: bpy.types.Action, labels: Sequence[str], first_frame: int) -> None:
    before = labels[0]
    if all(label == before for label in labels) and action.name == before:
        return
    for number, label in enumerate(labels):
        if number == 0 or label != before:
            action.pose_markers.new(label).frame = first_frame + number
        before = label


class _Keys:
    """Keys bones' rotations, none for a bone that rests where its last key put it."""

    def __init__(self, armature: bpy.types.Object, hold: bool) -> None:
        self._bones = armature.pose.bones
        self._hold = hold
        self._last: dict[str, tuple[int, np.ndarray]] = {}

    def rotate(self, name: str, local: np.ndarray, frame: int) -> None:
        """Keys bone `name` at `frame` with a rotation in its own axes."""
        quat = np.array(Matrix(local.tolist()).to_quaternion())
        if name in self._last:
            before, held = self._last[name]
            if held @ quat < 0:
                quat = -quat
            if np.abs(held - quat).max() < 1e-5:
                return
            if self._hold and before < frame - 1:
                self._insert(name, held, frame - 1)
        self._insert(name, quat, frame)

    def _insert(self, name: str, quat: np.ndarray, frame: int) -> None:
        self._last[name] = (frame, quat)
        bone = self._bones[name]
        bone.rotation_quaternion = quat
        bone.keyframe_insert("rotation_quaternion", frame=frame, group=name)
