# SPDX-License-Identifier: GPL-3.0-or-later
"""Arms that hang, swing or reach for a point."""

from __future__ import annotations

import numpy as np

from blender_scenes.motion.limbs import solve_limb
from blender_scenes.motion.rotations import about, about_x, about_y, about_z, frame_between
from blender_scenes.motion.skeleton import Pose, Skeleton


def hang_arm(turns: dict[str, np.ndarray], skeleton: Skeleton, side: str, swing: float) -> None:
    """Lets an arm hang from the chest in `turns`; `swing` -1 is back, 1 forward.

    The elbow bends as the arm comes forward.
    """
    sign = 1.0 if side == "L" else -1.0
    chest = turns["spine01"]
    clavicle = chest @ about_z(0.03 * swing * -sign) @ about_y(0.05 * sign)
    forward, bend = 0.07 + 0.33 * swing, 0.36 + 0.17 * swing
    upper = _hanging(forward, 0.19 * sign)
    fore = _hanging(forward + bend, -0.02 * sign)
    joints = [skeleton.head(f"{name}.{side}") for name in ("upperarm01", "lowerarm01", "wrist")]
    rest_upper, rest_fore = joints[1] - joints[0], joints[2] - joints[1]
    rest_hinge, hinge = np.cross(rest_upper, rest_fore), np.cross(upper, fore)
    turns[f"clavicle.{side}"] = clavicle
    turns[f"upperarm01.{side}"] = chest @ frame_between(rest_upper, rest_hinge, upper, hinge)
    turns[f"lowerarm01.{side}"] = chest @ frame_between(rest_fore, rest_hinge, fore, hinge)


def _hanging(forward_rad: float, outward_rad: float) -> np.ndarray:
    """Direction of a limb that hangs, raised forwards and to +x."""
    return about_y(-outward_rad) @ about_x(-forward_rad) @ np.array([0.0, 0.0, -1.0])


def relax_fingers(turns: dict[str, np.ndarray], skeleton: Skeleton, side: str) -> None:
    """Curls the fingers a little, as a hand that carries nothing does."""
    hand = turns[f"lowerarm01.{side}"]
    for finger in range(2, 6):
        knuckles = [skeleton.head(f"finger{finger}-{joint}.{side}") for joint in (1, 2, 3)]
        hinge = np.cross(knuckles[1] - knuckles[0], knuckles[2] - knuckles[1])
        curl = hand
        for joint, angle in ((1, 0.22 + 0.03 * finger), (2, 0.35), (3, 0.25)):
            curl = curl @ about(hinge, angle)
            turns[f"finger{finger}-{joint}.{side}"] = curl


def reach(
    skeleton: Skeleton, pose: Pose, side: str, wrist: np.ndarray, elbow_towards: np.ndarray
) -> Pose:
    """The same pose with one wrist brought to a point; trunk and shoulder stay.

    Args:
        skeleton: The body's joints.
        pose: Pose to start from.
        side: `L` or `R`.
        wrist: Where the wrist shall be in the world [m], shape (3,).
        elbow_towards: Direction the elbow points to, in the world, shape (3,).
    """
    names = [f"{name}.{side}" for name in ("upperarm01", "lowerarm01", "wrist")]
    rest = np.stack([skeleton.head(name) for name in names])
    start = skeleton.joints(pose)[skeleton.index[names[0]]]
    hinge = np.cross(rest[1] - rest[0], rest[2] - rest[1])
    upper, fore, _ = solve_limb(rest, hinge, start, wrist, elbow_towards)
    turns = {**pose.turns, names[0]: upper, names[1]: fore}
    # The hand and all below follow the forearm.
    turns = {name: turn for name, turn in turns.items() if not _of_hand(name, side)}
    relax_fingers(turns, skeleton, side)
    return Pose(pose.root, turns, pose.breath)


def _of_hand(bone: str, side: str) -> bool:
    return bone.endswith(f".{side}") and bone.startswith(("wrist", "finger", "lowerarm02"))
