# SPDX-License-Identifier: GPL-3.0-or-later
"""A parametric walk: its parameters, and where they carry the pelvis.

Phases and amplitudes follow Boulic, Thalmann and Thalmann, "A global human walking model with
real-time kinematic personification" (The Visual Computer, 1990), in the simplified form of
sinusoids. Feet come first (`blender_scenes.motion.feet`): the pelvis glides above footprints that
never move, so that no foot can slide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from blender_scenes.motion.footsteps import Steps
from blender_scenes.motion.rotations import about_x, about_y, about_z
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


def stand_width_m(legs: Legs) -> float:
    """Distance between the ankles of a person who stands [m]."""
    return 0.72 * float(legs.hip[0, 0] - legs.hip[1, 0])


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


def facing(heading_rad: float) -> np.ndarray:
    """Rotation that turns the rest pose, which looks along -y, to a heading from +x [rad]."""
    return about_z(heading_rad + np.pi / 2)
