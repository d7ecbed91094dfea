# SPDX-License-Identifier: Apache-2.0
"""Motion capture on a body of other proportions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from rfgs_core.errors import RfgsFormatError
from rfgs_core.motion_capture.joints import SIDES, match_joints
from rfgs_core.motion_capture.recording import Recording

#: Bones that turn so that they point where the recorded limb points, and what they point to.
_LIMBS = {
    "upperarm": "lowerarm",
    "lowerarm": "hand",
    "upperleg": "lowerleg",
    "lowerleg": "foot",
    "foot": "toe",
}
#: Axis that is up.
_UP = {"y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}


class Retargeted(NamedTuple):
    """How a body of ours does what was recorded."""

    root: Float64[np.ndarray, "frame 3"]
    """Where the pelvis's bone begins [m]."""
    turns: dict[str, Float64[np.ndarray, "frame 3 3"]]
    """Rotation of each bone that was recorded against the world, from rest."""


def retarget(
    recording: Recording, heads: Mapping[str, Float64[np.ndarray, "3"]], up: str = "y"
) -> Retargeted:
    """What was recorded, for a body of other proportions.

    Limbs point where the recorded ones do; trunk, head, hands and feet turn from their rest pose
    as the recorded ones turn from theirs. The way is scaled by the length of the legs.

    Args:
        recording: The recording.
        heads: Where each bone of our body begins at rest [m]; it looks along x.
        up: Axis that is up in the file, `y` or `z`. Where people look at rest is told by their
            hips: files differ.

    Raises:
        RfgsFormatError: The recording's joints are not those of a person, or legs have no length.
    """
    joints = {bone: row for bone, row in match_joints(recording).items() if bone in heads}
    axes = _axes(recording, joints, _UP[up])
    world = axes @ recording.world_turns() @ axes.T
    turns = {
        bone: world[:, joint] @ _correction(recording, heads, joints, axes, bone)
        for bone, joint in joints.items()
    }
    scale = _leg(heads) / _recorded_leg(recording, joints)
    places = recording.places()
    hips = 0.5 * sum(places[:, joints[f"upperleg_{side}"]] for side in SIDES.values())
    # Rigs begin above their hips or between them: what the legs hang from is put in place.
    middle = 0.5 * (heads["upperleg_left"] + heads["upperleg_right"])
    down = turns["pelvis"] @ (middle - heads["pelvis"])
    return Retargeted(scale * hips @ axes.T - down, turns)


def _axes(
    recording: Recording, joints: dict[str, int], up: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "3 3"]:
    """From the axes of a file to ours: x ahead, y to the left, z up."""
    left = sum(
        sign * _from_above(recording, joints[f"upperleg_{side}"], -1)
        for side, sign in (("left", 1.0), ("right", -1.0))
    )
    left = left - (left @ up) * up
    length = float(np.linalg.norm(left))
    if not length > 0.0:
        raise RfgsFormatError("expected hips beside each other at rest, found one above the other")
    left = left / length
    return np.stack([np.cross(left, up), left, up])


def _from_above(recording: Recording, joint: int, above: int) -> Float64[np.ndarray, "3"]:
    """From a joint further up, -1 for the root's, to one below at rest, in the file's axes."""
    way = np.zeros(3)
    while joint >= 0 and joint != above:
        way, joint = way + recording.offsets[joint], recording.parents[joint]
    return way


def _correction(
    recording: Recording,
    heads: Mapping[str, np.ndarray],
    joints: dict[str, int],
    axes: np.ndarray,
    bone: str,
) -> Float64[np.ndarray, "3 3"]:
    """Rotation from our rest pose to the recorded one for a limb; nothing for other bones."""
    plain, _, side = bone.partition("_")
    child = f"{_LIMBS.get(plain, '')}_{side}"
    if child not in joints:
        return np.eye(3)
    # Between two joints the recording may have others: twist bones, a second neck.
    recorded = axes @ _from_above(recording, joints[child], joints[bone])
    ours = heads[child] - heads[bone]
    axis = np.cross(ours, recorded)
    sine, cosine = float(np.linalg.norm(axis)), float(ours @ recorded)
    if sine < 1e-9 * max(abs(cosine), 1e-12):
        return np.eye(3)
    return Rotation.from_rotvec(np.arctan2(sine, cosine) / sine * axis).as_matrix()


def _leg(heads: Mapping[str, np.ndarray]) -> float:
    """Mean length of our legs [m]."""
    total = 0.0
    for side in SIDES.values():
        hip, knee, ankle = (heads[f"{b}_{side}"] for b in ("upperleg", "lowerleg", "foot"))
        total += float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
    return 0.5 * total


def _recorded_leg(recording: Recording, joints: dict[str, int]) -> float:
    """Mean length of the recorded legs, in units of the file."""
    total = 0.0
    for side in SIDES.values():
        joint = joints.get(f"foot_{side}", joints[f"lowerleg_{side}"])
        while joint >= 0 and joint != joints[f"upperleg_{side}"]:
            total += float(np.linalg.norm(recording.offsets[joint]))
            joint = recording.parents[joint]
    if not total > 0.0:
        raise RfgsFormatError("expected legs of some length, found hips, knees and feet together")
    return 0.5 * total
