# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays motion capture on a body of other proportions."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.motion.gait import facing
from blender_scenes.motion.gestures import minimum_jerk
from blender_scenes.motion.recording import Recording
from blender_scenes.motion.rotations import about, about_x, about_z
from blender_scenes.motion.score import Clip, Figure, Posture
from blender_scenes.motion.skeleton import Pose, Skeleton

#: Names that recordings use for each of our bones, in plain lower case; sides as l and r.
_NAMES = {
    "root": ("root", "hips", "pelvis", "hip"),
    "spine04": ("spine04", "spine", "abdomen", "lowerback"),
    "spine02": ("spine02", "spine1", "chest"),
    "spine01": ("spine01", "spine2", "chest2", "upperchest", "thorax"),
    "neck01": ("neck01", "neck", "neck1"),
    "head": ("head",),
    "clavicle": ("clavicle", "shoulder", "collar"),
    "upperarm01": ("upperarm01", "upperarm", "arm", "uparm"),
    "lowerarm01": ("lowerarm01", "lowerarm", "forearm", "lowarm", "elbow"),
    "wrist": ("wrist", "hand"),
    "upperleg01": ("upperleg01", "upleg", "thigh", "upperleg", "hip", "hipjoint"),
    "lowerleg01": ("lowerleg01", "leg", "shin", "calf", "lowerleg", "knee", "lowleg"),
    "foot": ("foot", "ankle"),
    "toe1-1": ("toe1-1", "toebase", "toe", "toes"),
}
#: Bones that turn so that they point where the recorded limb points, and what they point to.
_LIMBS = {
    "upperarm01": "lowerarm01",
    "lowerarm01": "wrist",
    "upperleg01": "lowerleg01",
    "lowerleg01": "foot",
    "foot": "toe1-1",
}
_NEEDED = ("root", *(f"{bone}.{side}" for bone in ("upperleg01", "lowerleg01") for side in "LR"))


def plain_name(joint: str) -> tuple[str, str]:
    """Lower-case name without prefix and side, and the side: `L`, `R` or nothing.

    Example:
        >>> plain_name("mixamorig:LeftUpLeg"), plain_name("rThigh"), plain_name("foot.R")
        (('upleg', 'L'), ('thigh', 'R'), ('foot', 'R'))
    """
    name = joint.rpartition(":")[2]
    for pattern in (
        r"^(?P<side>left|right)[ ._]*(?P<name>.+)$",
        r"^(?P<name>.+?)[ ._-](?P<side>left|right|l|r)$",
        r"^(?P<side>[lr])[ ._](?P<name>.+)$",
    ):
        match = re.match(pattern, name, re.IGNORECASE)
        if match:
            return _bare(match["name"]), match["side"][0].upper()
    # lThigh, rShin: a small letter before a capital one.
    match = re.match(r"^([lr])([A-Z].+)$", name)
    return (_bare(match[2]), match[1].upper()) if match else (_bare(name), "")


def _bare(name: str) -> str:
    return re.sub(r"[ ._]", "", name).lower()


def match_joints(recording: Recording) -> dict[str, int]:
    """Which recorded joint stands for each of our bones.

    Raises:
        ValueError: Hips, thighs or shins are not among the joints.
    """
    known = {
        plain_name(joint): index for index, joint in reversed(list(enumerate(recording.joints)))
    }
    found: dict[str, int] = {}
    for bone, names in _NAMES.items():
        paired = bone in (*_LIMBS, "clavicle", "wrist", "toe1-1")
        for side in "LR" if paired else ("",):
            joint = next((known[name, side] for name in names if (name, side) in known), None)
            if joint is not None:
                found[f"{bone}.{side}" if side else bone] = joint
    missing = [bone for bone in _NEEDED if bone not in found]
    if missing:
        raise ValueError(
            f"expected joints of a person; none of {', '.join(recording.joints)[:400]} is "
            f"{' or '.join(missing)}"
        )
    return found


def retarget(recording: Recording, skeleton: Skeleton, up: str = "y") -> list[Pose]:
    """One pose per recorded frame, for a body of other proportions.

    Limbs point where the recorded ones do; trunk, head, hands and feet turn from their rest pose
    as the recorded ones turn from theirs. The way is scaled by the length of the legs.

    Args:
        recording: The recording.
        skeleton: The body that shall move so.
        up: Axis that is up in the file: `y`, with people who look along +z at rest, or `z`,
            with people who look along -y.

    Raises:
        ValueError: The recording's joints are not those of a person.
    """
    joints = match_joints(recording)
    axes = {"y": about_x(0.5 * np.pi), "z": np.eye(3)}[up]
    world = np.einsum("ij,fbjk,lk->fbil", axes, recording.world_turns(), axes)
    corrections = {bone: _correction(recording, skeleton, joints, axes, bone) for bone in joints}
    scale = _leg_m(skeleton) / _recorded_leg(recording, joints)
    hips = scale * _hips(recording, joints) @ axes.T
    to_hips = _middle(skeleton.head, "upperleg01") - skeleton.head("root")
    poses = []
    for frame in range(len(recording.root)):
        turns = {bone: world[frame, joint] @ corrections[bone] for bone, joint in joints.items()}
        # Rigs begin above their hips or between them: what the legs hang from is put in place.
        poses.append(Pose(hips[frame] - turns["root"] @ to_hips, turns))
    return poses


def _hips(recording: Recording, joints: dict[str, int]) -> np.ndarray:
    """Middle between the recorded hips, in the axes and units of the file, shape (F, 3)."""
    places = recording.places()
    return 0.5 * (places[:, joints["upperleg01.L"]] + places[:, joints["upperleg01.R"]])


def _middle(head: Callable[[str], np.ndarray], bone: str) -> np.ndarray:
    return 0.5 * (head(f"{bone}.L") + head(f"{bone}.R"))


def _correction(
    recording: Recording, skeleton: Skeleton, joints: dict[str, int], axes: np.ndarray, bone: str
) -> np.ndarray:
    """Rotation from our rest pose to the recorded one for a limb; nothing for other bones."""
    plain, _, side = bone.partition(".")
    child = f"{_LIMBS.get(plain, '')}.{side}"
    if child not in joints:
        return np.eye(3)
    # Between two joints the recording may have others: twist bones, a second neck.
    recorded, joint = np.zeros(3), joints[child]
    while joint >= 0 and joint != joints[bone]:
        recorded, joint = recorded + recording.offsets[joint], recording.parents[joint]
    recorded = axes @ recorded
    ours = skeleton.head(child) - skeleton.head(bone)
    axis = np.cross(ours, recorded)
    sine, cosine = np.linalg.norm(axis), ours @ recorded
    if sine < 1e-9 * max(abs(cosine), 1e-12):
        return np.eye(3)
    return about(axis, float(np.arctan2(sine, cosine)))


def _leg_m(skeleton: Skeleton) -> float:
    legs = skeleton.legs
    thigh = np.linalg.norm(legs.knee - legs.hip, axis=1)
    return float((thigh + np.linalg.norm(legs.ankle - legs.knee, axis=1)).mean())


def _recorded_leg(recording: Recording, joints: dict[str, int]) -> float:
    """Mean length of the recorded legs, in units of the file."""
    total = 0.0
    for side in "LR":
        joint = joints.get(f"foot.{side}", joints[f"lowerleg01.{side}"])
        while joint >= 0 and joint != joints[f"upperleg01.{side}"]:
            total += float(np.linalg.norm(recording.offsets[joint]))
            joint = recording.parents[joint]
    return 0.5 * total


@dataclass(frozen=True)
class Recorded:
    """Plays a recording from where the person stands, and ends in standing.

    The recording is turned and shifted so that it sets off from the person's place and heading;
    at both ends it is blended with standing.
    """

    recording: Recording
    """What was read."""
    label: str
    """Name of the action."""
    up: str = "y"
    """Axis that is up in the file, `y` or `z`."""
    blend_s: float = 0.4
    """Duration of the blends [s]."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if start.kind != "stand":
            raise ValueError(f"expected to play {self.label} from standing, not: {start.kind}")
        poses = retarget(self.recording, figure.skeleton, self.up)
        shift = about_z(start.heading_rad - _heading(poses[0]))
        origin = poses[0].root * [1.0, 1.0, 0.0]
        place = np.array([*start.place_m, start.floor_m])
        poses = [
            Pose(
                place + shift @ (pose.root - origin),
                {name: shift @ turn for name, turn in pose.turns.items()},
            )
            for pose in poses
        ]
        last = poses[-1]
        end = replace(
            start, place_m=(float(last.root[0]), float(last.root[1])), heading_rad=_heading(last)
        )
        first_rest, last_rest = start.pose(figure), end.pose(figure)
        duration_s = self.recording.frame_s * (len(poses) - 1)

        def pose(time_s: float) -> Pose:
            index = min(time_s / self.recording.frame_s, len(poses) - 1.0)
            low = min(int(index), max(len(poses) - 2, 0))
            high = min(low + 1, len(poses) - 1)
            made = figure.skeleton.blend(poses[low], poses[high], index - low)
            into = minimum_jerk(time_s / self.blend_s)
            out = minimum_jerk((duration_s - time_s) / self.blend_s)
            if into < 1:
                made = figure.skeleton.blend(first_rest, made, into)
            return figure.skeleton.blend(last_rest, made, out) if out < 1 else made

        return [Clip(self.label, duration_s, pose, end)]


def _heading(pose: Pose) -> float:
    """Heading of the pelvis, counter-clockwise from +x [rad]."""
    ahead = pose.turns["root"] @ facing(-0.5 * np.pi) @ np.array([0.0, -1.0, 0.0])
    return float(np.arctan2(ahead[1], ahead[0]))
