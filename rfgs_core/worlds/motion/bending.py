# SPDX-License-Identifier: Apache-2.0
"""Down to the floor and up to the shelf, with both feet where they are."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.worlds.motion.arms import ArmPose, Shoulder, set_arm
from rfgs_core.worlds.motion.curves import X, Y, about, keyed, noise
from rfgs_core.worlds.motion.legs import Feet, plant, stance
from rfgs_core.worlds.motion.manner import quiet_arm
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.standing import follow_feet
from rfgs_core.worlds.motion.track import SIDES, Track


def squat(rng: np.random.Generator, body: Body) -> Track:
    """Squats or stoops, picks something up or only bends, and comes up again."""
    track = Track(body, rng.uniform(4.0, 8.0))
    knots, down = _visits(rng, track.times[-1], (0.7, 1.8), (0.2, 2.0))
    share = keyed(track.times, knots, down)
    knees = rng.uniform(0.1, 1.0)
    deep_m = body.height_m * (0.02 + 0.28 * knees) * rng.uniform(0.7, 1.0)
    pelvis = (0.95 - 0.5 * knees) * rng.uniform(0.6, 1.1)
    spine = rng.uniform(0.2, 0.9)
    places, heading = stance(body, rng)
    track.root[:, 0] -= share * body.height_m * (0.02 + 0.05 * pelvis)
    track.root[:, 1] = 0.005 * noise(rng, track.times, 0.4)
    track.root[:, 2] -= 0.006 * body.height_m + deep_m * share
    track.pelvis(0.0, pelvis * share, 0.0, rng.normal(0.0, 0.15) * share)
    track.trunk(
        0.04 + spine * share,
        rng.normal(0.0, 0.1) * share,
        rng.normal(0.0, 0.2) * share,
    )
    track.gaze(-0.4 * share * rng.uniform(0.0, 1.2), 0.0, 0.2 * noise(rng, track.times, 0.3))
    plant(track, Feet.standing(track.times, places, heading), rng.uniform(0.0, 0.4))
    hands = rng.choice(["both", "one", "ahead", "none"], p=[0.45, 0.25, 0.2, 0.1])
    busy = {"both": SIDES, "ahead": SIDES, "none": ()}.get(hands, (str(rng.choice(SIDES)),))
    lean = pelvis + spine
    for side in SIDES:
        if side in busy:
            shoulder = Shoulder(body, side)
            up = shoulder.hang(rng.uniform(0.1, 0.4), 0.05)
            far = rng.uniform(1.2, 1.7) if hands == "ahead" else rng.uniform(0.8, 1.1) * lean
            low = _ahead(shoulder, float(np.clip(far, 0.4, 2.4)), rng.uniform(0.05, 0.5))
            grasped = up if rng.uniform() < 0.5 else _ahead(shoulder, 0.5, 1.3)
            first = int(np.argmax(down > 0.5))
            poses = [low if d > 0.5 else (up if i < first else grasped) for i, d in enumerate(down)]
            set_arm(track, side, knots, poses)
        else:
            quiet_arm(rng, track, side)
    return track


def reach_high(rng: np.random.Generator, body: Body) -> Track:
    """Reaches for things over the head, on the toes or not."""
    track = Track(body, rng.uniform(4.0, 8.0))
    knots, up = _visits(rng, track.times[-1], (0.6, 1.4), (0.3, 2.0))
    share = keyed(track.times, knots, up)
    places, heading = stance(body, rng)
    feet = Feet.standing(track.times, places, heading)
    follow_feet(rng, track, feet, rng.uniform(0.0, 0.3))
    heel = rng.choice([0.0, rng.uniform(0.2, 0.6)]) * share
    feet.heel_rad = dict.fromkeys(SIDES, heel)
    track.root[:, 2] += 0.11 * body.height_m / 1.7 * np.sin(heel)
    bend, twist = rng.normal(0.0, 0.12), rng.normal(0.0, 0.25)
    track.trunk(0.04 - rng.uniform(0.0, 0.2) * share, bend * share, twist * share)
    track.gaze(-rng.uniform(0.0, 0.7) * share, 0.0, 0.15 * noise(rng, track.times, 0.3))
    plant(track, feet, rng.uniform(0.0, 0.15))
    busy = SIDES if rng.uniform() < 0.5 else (str(rng.choice(SIDES)),)
    for side in SIDES:
        if side in busy:
            _overhead(rng, track, side, knots, up)
        else:
            quiet_arm(rng, track, side)
    return track


def _overhead(
    rng: np.random.Generator, track: Track, side: str, knots: list[float], up: np.ndarray
) -> None:
    """An arm that is over the head where `up` is 1."""
    shoulder = Shoulder(track.body, side)
    home = shoulder.hang(rng.uniform(0.1, 0.4), 0.03)
    poses = []
    high = home
    for row, value in enumerate(up):
        if value > 0.5 and (row == 0 or up[row - 1] < 0.5):
            way = np.array([rng.uniform(0.05, 0.6), shoulder.sign * rng.uniform(-0.1, 0.4), 1.0])
            far = shoulder.reach_m * rng.uniform(0.75, 1.0)
            high = shoulder.reach(
                shoulder.place + far * way / np.linalg.norm(way), rng.uniform(0, 0.5)
            )
        poses.append(high if value > 0.5 else home)
    set_arm(track, side, knots, poses)


def _ahead(shoulder: Shoulder, flexion: float, elbow: float) -> ArmPose:
    """The arm held ahead by `flexion` [rad] from hanging, a little inwards."""
    turn = about(X, 0.04 * shoulder.sign) @ about(Y, -flexion)
    return ArmPose(turn, elbow)


def _visits(
    rng: np.random.Generator, lasts_s: float, going_s: tuple[float, float],
    staying_s: tuple[float, float],
) -> tuple[list[float], np.ndarray]:  # fmt: skip
    """Times and values, 1 where somebody is down or up there and 0 else, at least once."""
    time_s = rng.uniform(0.1, 0.8)
    knots, values = [0.0, time_s], [0.0, 0.0]
    going = rng.uniform(*going_s)
    while True:
        stay = rng.uniform(*staying_s)
        if len(knots) > 2 and time_s + 2 * going + stay > lasts_s:
            break
        for value, after in ((1.0, going), (1.0, stay), (0.0, going), (0.0, rng.uniform(0.1, 1))):
            time_s += max(after, 2.0 / RATE_HZ)
            knots.append(time_s)
            values.append(value)
    return knots, np.array(values)
