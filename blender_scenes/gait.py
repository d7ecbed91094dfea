# SPDX-License-Identifier: GPL-3.0-or-later
"""A parametric walk: where feet and pelvis are, and which way every moving bone turns.

Feet come first. Each foot stands on a footprint that never moves: it lands on its heel, lies
flat, then rolls over the ball. The pelvis glides above, and inverse kinematics gives hip and
knee, so that no foot can slide. Phases and amplitudes follow Boulic, Thalmann and Thalmann,
"A global human walking model" (1990), in the simplified form of sinusoids.

Axes of the rest pose: the person looks along -y, left is +x, z is up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from blender_scenes.rotations import about_x, about_y, about_z, frame_between, smoothstep
from blender_scenes.walk_path import ArcPath


@dataclass(frozen=True)
class Legs:
    """Rest positions of the joints of both legs and of the pelvis [m], left leg first."""

    root: np.ndarray
    """Pelvis, shape (3,)."""
    hip: np.ndarray
    """Hips, shape (2, 3)."""
    knee: np.ndarray
    """Knees, shape (2, 3)."""
    ankle: np.ndarray
    """Ankles, shape (2, 3)."""
    toe: np.ndarray
    """Joints between foot and toes, shape (2, 3)."""
    heel: np.ndarray
    """Lowest points of the heels, on z = 0, shape (2, 3)."""


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

    @property
    def speed_m_s(self) -> float:
        """Walking speed [m/s]."""
        return self.step_m / self.step_s

    def phase(self, time_s: float) -> float:
        """Cycles passed since the left heel struck at time 0."""
        return time_s / (2 * self.step_s)

    def travelled(self, time_s: float) -> float:
        """Length of path [m] the pelvis has covered, measured from the left foot's first print."""
        # The pelvis passes over a foot in the middle of that foot's stance.
        return self.speed_m_s * time_s - self.stance * self.step_m


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


def feet_at(gait: Gait, legs: Legs, path: ArcPath, time_s: float) -> Feet:
    """Where both feet are at `time_s` [s]."""
    parts = [_one_foot(gait, legs, path, time_s, side) for side in (0, 1)]
    return Feet(*(np.stack([part[index] for part in parts]) for index in range(4)))


def pelvis_at(
    gait: Gait, legs: Legs, path: ArcPath, time_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] of the pelvis and its rotation from rest to world at `time_s` [s]."""
    cycle = 2 * np.pi * gait.phase(time_s)
    s = gait.travelled(time_s)
    heading = float(path.heading(s))
    middle = np.pi * gait.stance
    # Highest and nearest to the standing foot in the middle of each stance.
    rise = gait.bob_m * np.cos(2 * (cycle - middle))
    sway = gait.sway_m * np.cos(cycle - middle)
    yaw = -gait.pelvis_yaw_rad * np.cos(cycle)
    tilt = -gait.pelvis_list_rad * np.cos(cycle - middle)
    left = np.array([-np.sin(heading), np.cos(heading)])
    position = np.append(path.position(s) + sway * left, legs.root[2] - gait.drop_m + rise)
    turn = facing(heading + yaw) @ about_y(tilt) @ about_x(0.5 * gait.lean_rad)
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
    reach = feet.ankle[side] - hip
    thigh = np.linalg.norm(legs.knee[side] - legs.hip[side])
    shin = np.linalg.norm(legs.ankle[side] - legs.knee[side])
    distance = np.linalg.norm(reach)
    stretch = float(distance / (thigh + shin))
    down = reach / distance
    # Knees point halfway between the pelvis' and the foot's heading.
    ahead = -(pelvis[:, 1] + feet.foot[side][:, 1] * np.array([1.0, 1.0, 0.0]))
    ahead = ahead - down * (ahead @ down)
    ahead /= np.linalg.norm(ahead)
    along = (distance**2 + thigh**2 - shin**2) / (2 * distance)
    out = np.sqrt(max(thigh**2 - along**2, 0.0))
    knee = hip + along * down + out * ahead
    hinge, rest_hinge = np.cross(ahead, down), np.array([1.0, 0.0, 0.0])
    rest_thigh = legs.knee[side] - legs.hip[side]
    rest_shin = legs.ankle[side] - legs.knee[side]
    return (
        frame_between(rest_thigh, rest_hinge, knee - hip, hinge),
        frame_between(rest_shin, rest_hinge, feet.ankle[side] - knee, hinge),
        stretch,
    )


def facing(heading_rad: float) -> np.ndarray:
    """Rotation that turns the rest pose, which looks along -y, to a heading from +x [rad]."""
    return about_z(heading_rad + np.pi / 2)


def _one_foot(
    gait: Gait, legs: Legs, path: ArcPath, time_s: float, side: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    # The right foot (side 1) strikes one step, half a cycle, after the left one.
    local = gait.phase(time_s) - 0.5 * side
    count = int(np.floor(local))
    phase, print_number = local - count, 2 * count + side
    if phase < gait.stance:
        ankle, pitch = _stance(gait, legs, path, side, print_number, phase)
        toe_pitch = max(pitch, 0.0)
        planted = gait.flat_from <= phase <= gait.flat_to
        yaw = _print(gait, path, side, print_number)[1]
    else:
        share = (phase - gait.stance) / (1 - gait.stance)
        ankle, pitch = _swing(gait, legs, path, side, print_number, share)
        toe_pitch = pitch + gait.toe_off_rad * (1 - smoothstep(share / 0.5))
        planted = False
        yaws = [_print(gait, path, side, print_number + 2 * step)[1] for step in (0, 1)]
        yaw = yaws[0] + smoothstep(share) * (yaws[1] - yaws[0])
    level = about_z(yaw)
    return ankle, level @ about_x(-pitch), level @ about_x(-toe_pitch), planted


def _print(gait: Gait, path: ArcPath, side: int, number: int) -> tuple[np.ndarray, float]:
    """Ground point below the ankle [m] and yaw from rest [rad] of footprint `number`."""
    s = number * gait.step_m
    heading = float(path.heading(s))
    outward = 1.0 if side == 0 else -1.0
    left = np.array([-np.sin(heading), np.cos(heading)])
    place = path.position(s) + 0.5 * outward * gait.width_m * left
    return np.append(place, 0.0), heading + np.pi / 2 + outward * gait.toe_out_rad


def _stance(
    gait: Gait, legs: Legs, path: ArcPath, side: int, number: int, phase: float
) -> tuple[np.ndarray, float]:
    """Ankle [m] and pitch of a foot that rolls over heel, sole and ball on its print."""
    place, yaw = _print(gait, path, side, number)
    ankle = legs.ankle[side]
    if phase < gait.flat_from:
        pitch = gait.heel_strike_rad * (1 - smoothstep(phase / gait.flat_from))
        pivot = legs.heel[side]
    else:
        share = max(phase - gait.flat_to, 0.0) / (gait.stance - gait.flat_to)
        # Quadratic: the heel leaves the ground without a jerk and is fast at toe-off.
        pitch = -gait.toe_off_rad * share**2
        pivot = legs.toe[side]
    below = np.array([ankle[0], ankle[1], 0.0])
    local = pivot - below + about_x(-pitch) @ (ankle - pivot)
    return place + about_z(yaw) @ local, pitch


def _swing(
    gait: Gait, legs: Legs, path: ArcPath, side: int, number: int, share: float
) -> tuple[np.ndarray, float]:
    """Ankle [m] and pitch of a foot on its way from one print to its next."""
    step = 1e-4
    start, start_pitch = _stance(gait, legs, path, side, number, gait.stance)
    before, before_pitch = _stance(gait, legs, path, side, number, gait.stance - step)
    end, end_pitch = _stance(gait, legs, path, side, number + 2, 0.0)
    duration = 1 - gait.stance
    velocity = (start - before) / step * duration
    spin = (start_pitch - before_pitch) / step * duration
    # The foot comes down on its heel nearly straight from above, slowing as it goes.
    arrival = 0.35 * (end - start) * np.array([1.0, 1.0, 0.0]) + np.array([0.0, 0.0, -0.05])
    ankle = _hermite(share, start, velocity, end, arrival)
    ankle = ankle + np.array([0.0, 0.0, gait.lift_m * np.sin(np.pi * share) ** 2])
    pitch = _hermite(share, np.array(start_pitch), np.array(0.6 * spin), np.array(end_pitch), 0.0)
    return ankle, float(pitch)


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
