# SPDX-License-Identifier: GPL-3.0-or-later
"""The pose of a whole body on its feet: legs, trunk, arms and fingers."""

from __future__ import annotations

import numpy as np

from blender_scenes.motion.arms import hang_arm, relax_fingers
from blender_scenes.motion.feet import feet_at, solve_leg
from blender_scenes.motion.footsteps import Steps
from blender_scenes.motion.gait import Gait, facing, pelvis_at
from blender_scenes.motion.rotations import about_x, about_y
from blender_scenes.motion.skeleton import SIDES, Pose, Skeleton

SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01")


def walking_pose(
    gait: Gait, skeleton: Skeleton, steps: Steps, phase: float, drop_m: float = 0.0
) -> Pose:
    """The pose at `phase`, in steps; standing where `steps` have no strength.

    Args:
        gait: How the person walks.
        skeleton: The body's joints.
        steps: Where to.
        phase: Steps since footprint 0 was touched first.
        drop_m: How much lower than the gait's own height the pelvis is carried [m].
    """
    legs = skeleton.legs
    feet = feet_at(gait, legs, steps, phase)
    root, pelvis = pelvis_at(gait, legs, steps, phase, drop_m)
    turns = {"root": pelvis}
    for index, side in enumerate(SIDES):
        thigh, shin, _ = solve_leg(legs, index, root, pelvis, feet)
        turns[f"upperleg01.{side}"], turns[f"lowerleg01.{side}"] = thigh, shin
        turns[f"foot.{side}"], turns[f"toe1-1.{side}"] = feet.foot[index], feet.toes[index]
    _trunk(turns, gait, steps, phase)
    strength = steps.strength(phase)
    for side in SIDES:
        sign = 1.0 if side == "L" else -1.0
        # The left arm is foremost as the right heel strikes, half a cycle after the left one.
        swing = -sign * strength * gait.arm_swing * np.cos(np.pi * phase - 0.25)
        hang_arm(turns, skeleton, side, swing)
        relax_fingers(turns, skeleton, side)
    return Pose(root, turns)


def _trunk(turns: dict[str, np.ndarray], gait: Gait, steps: Steps, phase: float) -> None:
    """Turns the chest against the pelvis and keeps the head on the path."""
    cycle, heading, strength = np.pi * phase, steps.guide(phase).heading_rad, steps.strength(phase)
    chest_yaw = 0.75 * strength * gait.pelvis_yaw_rad * np.cos(cycle)
    pelvis_yaw = -strength * gait.pelvis_yaw_rad * np.cos(cycle)
    roll = strength * gait.pelvis_list_rad * np.cos(cycle - np.pi * gait.stance)
    for index, bone in enumerate(SPINE):
        share = (index + 1) / len(SPINE)
        yaw = pelvis_yaw + share * (chest_yaw - pelvis_yaw)
        lean = strength * gait.lean_rad * (0.5 + 0.5 * share)
        turns[bone] = facing(heading + yaw) @ about_y((1.3 * share - 1) * roll) @ about_x(lean)
    # Eyes go where the feet will be in a second; nodding keeps the neck from looking frozen.
    ahead = steps.guide(phase + strength / gait.step_s).heading_rad
    nod = 0.02 * strength * np.cos(2 * cycle)
    neck = facing(0.5 * (heading + ahead) + 0.3 * chest_yaw)
    turns["neck01"] = neck @ about_x(strength * gait.lean_rad)
    turns["head"] = facing(ahead) @ about_x(0.05 + nod)
