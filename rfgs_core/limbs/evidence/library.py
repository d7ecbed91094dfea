# SPDX-License-Identifier: Apache-2.0
"""Strides to choose from: whole ones out of random walks, at equal phases."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from rfgs_core.articulated import BONES, Body, Pose, grounded
from rfgs_core.seeds import sub_seed
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.motion import Motion, random_motion
from rfgs_core.worlds.motion.curves import Y, about

#: Phases of a stride that are tried.
PHASES = 12
#: A stride's speed is off the wanted one by at most this share, and it turns by at most this [rad].
_OFF, _TURNS_RAD = 0.2, 0.25
#: How much more than in a stride hips may be bent, and knees twice that [rad].
BENDS_RAD = (0.0, 0.05, 0.1, 0.15, 0.2)
#: Walks that are looked through for strides.
_MOST_WALKS = 400
#: Moments per second at which walks are looked at.
_RATE_HZ = 25.0


class Stride(NamedTuple):
    """One stride on the spot, facing along x, from a heel strike of the left foot on."""

    poses: list[Pose]
    """At `PHASES` equal phases, pelvis above the origin."""
    lasts_s: float
    """From one heel strike of the left foot to the next [s]."""

    def bent(self, body: Body, bend_rad: float) -> Stride:
        """The stride of the same person on legs that are bent more; feet stay as level as before.

        How low somebody walks differs by centimetres from person to person.

        Args:
            body: Who walks.
            bend_rad: How much more hips are bent [rad]; knees are by twice as much.
        """
        turns = {"upperleg": -bend_rad, "lowerleg": 2.0 * bend_rad, "foot": -bend_rad}
        poses = []
        for pose in self.poses:
            local = pose.local()
            for row, name in enumerate(BONES):
                angle_rad = turns.get(name.split("_")[0])
                if angle_rad is not None:
                    local[row] = about(Y, angle_rad) @ local[row]
            low = grounded(body, Pose.from_local(body.heads[0], local))
            poses.append(over_origin(body, low))
        return Stride(poses, self.lasts_s)


def upright(body: Body) -> Pose:
    """Who stands with hanging arms above the origin and looks along x."""
    return over_origin(body, grounded(body, Pose(body.heads[0], body.neutral)))


def strides(body: Body, speed_m_s: float, count: int, seed: int) -> list[Stride]:
    """Strides of random walks at about a speed.

    Args:
        body: Who walks.
        speed_m_s: Wanted speed [m/s]; those farther off come where there are no others.
        count: How many.
        seed: Seed of the walks.
    """
    rng = np.random.default_rng(sub_seed(seed, "strides"))
    found: list[Stride] = []
    speed_m_s = float(np.clip(speed_m_s, 0.4, 1.7))
    for _ in range(_MOST_WALKS):
        motion = random_motion(rng, body, "walk")
        stride = _straight(motion, body, speed_m_s)
        if stride is not None:
            found.append(stride)
        if len(found) == count:
            break
    return found


def _straight(motion: Motion, body: Body, speed_m_s: float) -> Stride | None:
    """A stride of a walk that is straight and as fast as wanted; None if there is none."""
    times = np.arange(0.0, motion.duration_s, 1.0 / _RATE_HZ)
    joints = np.array([body.joints17(motion.at(t)) for t in times])
    heading = np.unwrap(headings_of(joints))
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    ankle = {s: joints[:, JOINTS.index(f"{s}_ankle"), :2] for s in ("left", "right")}
    reach = np.einsum("tx,tx->t", ankle["left"] - ankle["right"], ahead)
    strikes = _peaks(reach)
    for start, end in pairwise(strikes):
        lasts_s = (end - start) / _RATE_HZ
        if not 0.6 < lasts_s < 2.5:
            continue
        way_m = np.linalg.norm(joints[end, 0, :2] - joints[start, 0, :2])
        off = abs(way_m / lasts_s / speed_m_s - 1.0)
        if off > _OFF or np.ptp(heading[start : end + 1]) > _TURNS_RAD:
            continue
        moments = times[start] + lasts_s * np.arange(PHASES) / PHASES
        # One heading for the whole stride: how the trunk twists belongs to it.
        back = -float(heading[start:end].mean())
        turn = about_z(back)
        return Stride([over_origin(body, motion.at(t).turned(turn)) for t in moments], lasts_s)
    return None


def _peaks(reach: Float64[np.ndarray, "moment"]) -> list[int]:
    """When the left foot is farthest ahead."""
    high = 0.3 * np.abs(reach).max()
    inner = (reach[1:-1] >= reach[:-2]) & (reach[1:-1] > reach[2:]) & (reach[1:-1] > high)
    return (np.flatnonzero(inner) + 1).tolist()


def over_origin(body: Body, pose: Pose) -> Pose:
    """The pose with the pelvis above the origin, as high as before."""
    return pose.moved(-body.joints17(pose)[0] * [1.0, 1.0, 0.0])


def about_z(angle_rad: float) -> Float64[np.ndarray, "3 3"]:
    """A turn around the vertical."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def headings_of(joints: Float64[np.ndarray, "frame 17 3"]) -> Float64[np.ndarray, "frame"]:
    """Ahead is at right angles to the hips and shoulders, from x towards y [rad]."""
    at = {name: joints[:, JOINTS.index(name), :2] for name in JOINTS}
    left = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
    return np.arctan2(left[:, 1], left[:, 0]) - 0.5 * np.pi
