# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the feet of a walking person are, and the legs above them.

Each foot lands on its heel, lies flat, then rolls over the ball; between two footprints it
swings. Inverse kinematics gives hip and knee.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from blender_scenes.motion.footsteps import Footprint, Steps
from blender_scenes.motion.gait import Gait
from blender_scenes.motion.limbs import solve_limb
from blender_scenes.motion.rotations import about_x, about_z, smoothstep
from blender_scenes.motion.skeleton import Legs


@dataclass(frozen=True)
class Feet:
    """Both feet at one time, left first."""

    ankle: np.ndarray
    """Positions [m], shape (2, 3)."""
    foot: np.ndarray
    """Rotations from rest to world, shape (2, 3, 3)."""
    toes: np.ndarray
    """Rotations of the toes from rest to world, shape (2, 3, 3)."""
    planted: np.ndarray
    """Whether the sole lies flat on the ground, shape (2,)."""


def feet_at(gait: Gait, legs: Legs, steps: Steps, phase: float) -> Feet:
    """Where both feet are at `phase`, in steps."""
    parts = [_one_foot(gait, legs, steps, phase, side) for side in (0, 1)]
    return Feet(*(np.stack([part[index] for part in parts]) for index in range(4)))


def solve_leg(
    legs: Legs, side: int, root: np.ndarray, pelvis: np.ndarray, feet: Feet
) -> tuple[np.ndarray, np.ndarray, float]:
    """Rotations of thigh and shin that put the ankle where the foot needs it.

    Args:
        legs: Rest joints.
        side: 0 left, 1 right.
        root: Position of the pelvis [m].
        pelvis: Its rotation from rest to world.
        feet: Targets.

    Returns:
        Rotations from rest to world of thigh and shin, and how far the leg is stretched,
        1 being straight.
    """
    hip = root + pelvis @ (legs.hip[side] - legs.root)
    # Knees point halfway between the pelvis' and the foot's heading.
    ahead = -(pelvis[:, 1] + feet.foot[side][:, 1] * np.array([1.0, 1.0, 0.0]))
    rest = np.stack([legs.hip[side], legs.knee[side], legs.ankle[side]])
    return solve_limb(rest, np.array([1.0, 0.0, 0.0]), hip, feet.ankle[side], ahead)


def _one_foot(
    gait: Gait, legs: Legs, steps: Steps, phase: float, side: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    # The right foot (side 1) strikes one step, half a cycle, after the left one.
    local = 0.5 * (phase - side)
    count = int(np.floor(local))
    share, number = local - count, 2 * count + side
    earliest, latest = (n + (n - side) % 2 * d for n, d in ((steps.first, 1), (steps.last, -1)))
    if number < earliest:
        number, share = earliest, gait.flat_from
    if number > latest:
        number, share = latest, gait.flat_to
    if number == latest:
        share = min(share, gait.flat_to)
    here = steps.footprint(number)
    if share < gait.stance:
        ankle, pitch = _stance(gait, legs, here, side, share)
        toe_pitch = max(pitch, 0.0)
        planted, yaw = gait.flat_from <= share <= gait.flat_to, here.yaw_rad
    else:
        there, share = steps.footprint(number + 2), (share - gait.stance) / (1 - gait.stance)
        ankle, pitch = _swing(gait, legs, here, there, side, share)
        lifted = here.leaving * gait.toe_off_rad
        toe_pitch = pitch + lifted * (1 - smoothstep(share / 0.5))
        planted = False
        yaw = here.yaw_rad + smoothstep(share) * (there.yaw_rad - here.yaw_rad)
    level = about_z(yaw)
    return ankle, level @ about_x(-pitch), level @ about_x(-toe_pitch), planted


def _stance(
    gait: Gait, legs: Legs, here: Footprint, side: int, share: float
) -> tuple[np.ndarray, float]:
    """Ankle [m] and pitch of a foot that rolls over heel, sole and ball on its print."""
    ankle = legs.ankle[side]
    if share < gait.flat_from:
        pitch = here.landing * gait.heel_strike_rad * (1 - smoothstep(share / gait.flat_from))
        pivot = legs.heel[side]
    else:
        rolled = max(share - gait.flat_to, 0.0) / (gait.stance - gait.flat_to)
        # Quadratic: the heel leaves the ground without a jerk and is fast at toe-off.
        pitch = -here.leaving * gait.toe_off_rad * rolled**2
        pivot = legs.toe[side]
    below = np.array([ankle[0], ankle[1], 0.0])
    local = pivot - below + about_x(-pitch) @ (ankle - pivot)
    return here.place + about_z(here.yaw_rad) @ local, pitch


def _swing(
    gait: Gait, legs: Legs, here: Footprint, there: Footprint, side: int, share: float
) -> tuple[np.ndarray, float]:
    """Ankle [m] and pitch of a foot on its way from one print to its next."""
    step = 1e-4
    start, start_pitch = _stance(gait, legs, here, side, gait.stance)
    before, before_pitch = _stance(gait, legs, here, side, gait.stance - step)
    end, end_pitch = _stance(gait, legs, there, side, 0.0)
    duration = 1 - gait.stance
    velocity = (start - before) / step * duration
    spin = (start_pitch - before_pitch) / step * duration
    # The foot comes down on its heel nearly straight from above, slowing as it goes.
    arrival = 0.35 * (end - start) * np.array([1.0, 1.0, 0.0]) + np.array([0.0, 0.0, -0.05])
    climbed = there.place[2] - here.place[2]
    if climbed == 0:
        ankle = _hermite(share, start, velocity, end, arrival)
        ankle = ankle + np.array([0.0, 0.0, gait.lift_m * np.sin(np.pi * share) ** 2])
    else:
        ankle = _over_edge(share, start, end, gait.lift_m + 0.15 * abs(climbed), climbed > 0)
    pitch = _hermite(share, np.array(start_pitch), np.array(0.6 * spin), np.array(end_pitch), 0.0)
    return ankle, float(pitch)


def _over_edge(
    share: float, start: np.ndarray, end: np.ndarray, lift_m: float, up: bool
) -> np.ndarray:
    """Ankle [m] of a foot that changes levels: up before it goes ahead, or ahead and then down."""
    ahead = smoothstep((share - 0.22) / 0.78) if up else smoothstep(share / 0.75)
    risen = smoothstep(share / 0.6) if up else smoothstep((share - 0.5) / 0.5)
    ankle = start + ahead * (end - start)
    ankle[2] = start[2] + risen * (end[2] - start[2]) + lift_m * np.sin(np.pi * share) ** 2
    return ankle


def _hermite(
    u: float, start: np.ndarray, velocity: np.ndarray, end: np.ndarray, arrival: np.ndarray | float
) -> np.ndarray:
    """Cubic from `start` to `end` over u in [0, 1] with given end velocities."""
    u2, u3 = u * u, u * u * u
    blend = 3 * u2 - 2 * u3
    return (
        (1 - blend) * start
        + (u3 - 2 * u2 + u) * velocity
        + blend * end
        + (u3 - u2) * np.asarray(arrival)
    )
