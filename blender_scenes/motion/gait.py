# SPDX-License-Identifier: GPL-3.0-or-later
"""A parametric walk: where feet and pelvis are, and which way every moving bone turns.

Feet come first. Each foot stands on a footprint that never moves: it lands on its heel, lies
flat, then rolls over the ball. The pelvis glides above, and inverse kinematics gives hip and
knee, so that no foot can slide. Phases and amplitudes follow Boulic, Thalmann and Thalmann,
"A global human walking model with real-time kinematic personification" (The Visual Computer,
1990), in the simplified form of sinusoids.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from blender_scenes.motion.footsteps import Footprint, Steps
from blender_scenes.motion.limbs import solve_limb
from blender_scenes.motion.rotations import about_x, about_y, about_z, smoothstep
from blender_scenes.motion.skeleton import Legs


@dataclass(frozen=True)
class Manner:
    """What makes one person's walk differ from another's; 1 is ordinary."""

    arm_swing: float = 1.0
    """Swing of the arms."""
    sway: float = 1.0
    """Motion of the pelvis from side to side."""
    bounce: float = 1.0
    """Rise and fall of the pelvis."""
    cadence: float = 1.0
    """Steps per time at a given speed; above 1 they are shorter."""
    toe_out_rad: float = 0.09
    """Outward turn of the feet."""
    stoop_rad: float = 0.0
    """Forward bend of the back beyond an upright one."""
    breaths_per_min: float = 14.0
    """Breaths per minute at rest."""


@dataclass(frozen=True)
class Gait:
    """Parameters of a walk; angles in radians, a cycle is two steps."""

    step_m: float = 0.52
    """Distance from one footprint to the next along the path [m]."""
    step_s: float = 0.765
    """Time of one step [s]."""
    width_m: float = 0.17
    """Distance between the ankles across the path [m]."""
    stance: float = 0.62
    """Share of the cycle in which a foot touches the ground."""
    flat_from: float = 0.10
    """Share of the cycle at which the sole lies flat."""
    flat_to: float = 0.34
    """Share of the cycle at which the heel lifts."""
    heel_strike_rad: float = 0.30
    """Pitch of the foot as the heel lands, toes up."""
    toe_off_rad: float = 0.62
    """Pitch of the foot as the toes leave, heel up."""
    toe_out_rad: float = 0.09
    """Outward turn of the feet."""
    lift_m: float = 0.02
    """Extra height of the ankle in mid swing [m]."""
    bob_m: float = 0.011
    """Amplitude of the pelvis' rise and fall [m]."""
    sway_m: float = 0.017
    """Amplitude of the pelvis' motion towards the standing leg [m]."""
    drop_m: float = 0.034
    """How much lower the pelvis is carried than in the rest pose [m]."""
    pelvis_yaw_rad: float = 0.09
    """Amplitude of the pelvis' turn towards the leading leg."""
    pelvis_list_rad: float = 0.045
    """Amplitude of the pelvis' drop towards the swinging leg."""
    lean_rad: float = 0.035
    """Forward lean of the trunk."""
    stand_drop_m: float = 0.006
    """How much lower than in the rest pose the pelvis is carried in standing [m]."""
    arm_swing: float = 1.0
    """Swing of the arms, as a share of an ordinary one."""

    @property
    def speed_m_s(self) -> float:
        """Walking speed [m/s]."""
        return self.step_m / self.step_s

    @classmethod
    def for_speed(cls, speed_m_s: float, legs: Legs, manner: Manner) -> Gait:
        """How a person with these `legs` walks at a speed, in her or his manner.

        Length and duration of a cycle and the share of stance follow Boulic, Thalmann and
        Thalmann (1990), section 3, with lengths in units of the hip's height and speeds in
        hip heights per second.

        Raises:
            ValueError: The speed is no walking speed for these legs.
        """
        hip_m = float(legs.hip[:, 2].mean())
        relative = speed_m_s / hip_m
        if not 0.2 <= relative <= 2.3:
            raise ValueError(
                f"expected a walking speed of {0.2 * hip_m:.2f} to {2.3 * hip_m:.2f} m/s, "
                f"got {speed_m_s:g}"
            )
        cycle_m = 1.346 * np.sqrt(relative) * hip_m / manner.cadence
        cycle_s = cycle_m / speed_m_s
        stance = float(np.clip(0.752 - 0.143 / cycle_s, 0.55, 0.72))
        stride = 0.5 * cycle_m / (0.58 * hip_m)
        default = cls()
        return cls(
            step_m=0.5 * cycle_m,
            step_s=0.5 * cycle_s,
            width_m=stand_width_m(legs),
            stance=stance,
            flat_to=0.55 * stance,
            heel_strike_rad=min(default.heel_strike_rad * stride, 0.42),
            toe_off_rad=min(default.toe_off_rad * stride, 0.85),
            toe_out_rad=manner.toe_out_rad,
            bob_m=0.015 * relative * hip_m * manner.bounce,
            sway_m=default.sway_m * manner.sway,
            drop_m=0.014,
            pelvis_yaw_rad=min(default.pelvis_yaw_rad * stride, 0.14),
            pelvis_list_rad=default.pelvis_list_rad * manner.sway,
            lean_rad=default.lean_rad * max(relative, 0.5) + manner.stoop_rad,
            arm_swing=manner.arm_swing * min(stride, 1.4),
        )


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


def stand_width_m(legs: Legs) -> float:
    """Distance between the ankles of a person who stands [m]."""
    return 0.72 * float(legs.hip[0, 0] - legs.hip[1, 0])


def feet_at(gait: Gait, legs: Legs, steps: Steps, phase: float) -> Feet:
    """Where both feet are at `phase`, in steps."""
    parts = [_one_foot(gait, legs, steps, phase, side) for side in (0, 1)]
    return Feet(*(np.stack([part[index] for part in parts]) for index in range(4)))


def pelvis_at(
    gait: Gait, legs: Legs, steps: Steps, phase: float, drop_m: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] of the pelvis and its rotation from rest to world at `phase`, in steps.

    Args:
        gait: How the person walks.
        legs: Rest joints.
        steps: Where to.
        phase: Steps since footprint 0 was touched first.
        drop_m: How much lower than the gait's own height the pelvis is carried [m].
    """
    cycle, guide, strength = np.pi * phase, steps.guide(phase), steps.strength(phase)
    middle = np.pi * gait.stance
    # Highest and nearest to the standing foot in the middle of each stance.
    rise = strength * gait.bob_m * np.cos(2 * (cycle - middle))
    sway = strength * gait.sway_m * np.cos(cycle - middle)
    yaw = -strength * gait.pelvis_yaw_rad * np.cos(cycle)
    tilt = -strength * gait.pelvis_list_rad * np.cos(cycle - middle)
    low = gait.stand_drop_m + strength * (gait.drop_m - gait.stand_drop_m) + drop_m
    left = np.array([-np.sin(guide.heading_rad), np.cos(guide.heading_rad)])
    height = guide.floor_m + legs.root[2] - low + rise
    position = np.append(guide.place + sway * left, height)
    lean = 0.5 * strength * gait.lean_rad
    turn = facing(guide.heading_rad + yaw) @ about_y(tilt) @ about_x(lean)
    return position, turn


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


def facing(heading_rad: float) -> np.ndarray:
    """Rotation that turns the rest pose, which looks along -y, to a heading from +x [rad]."""
    return about_z(heading_rad + np.pi / 2)


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
