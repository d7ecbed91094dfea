# SPDX-License-Identifier: Apache-2.0
"""On a seat: sitting down, being seated with arms and legs in motion, standing up."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body, Pose
from rfgs_core.articulated.bones import BONES, bone
from rfgs_core.worlds.motion.arms import Shoulder
from rfgs_core.worlds.motion.curves import Y, about, between, noise
from rfgs_core.worlds.motion.legs import Feet, Step, plant, stance
from rfgs_core.worlds.motion.manner import gesture, lap_pose, quiet_arm
from rfgs_core.worlds.motion.standing import move_arms
from rfgs_core.worlds.motion.track import SIDES, SIGN, Track

#: Bones whose skin bears somebody who sits.
SEATED = ("pelvis", "upperleg_left", "upperleg_right")


def sit(rng: np.random.Generator, body: Body) -> Track:
    """Sits down, sits, stands up: one of them, or all."""
    kind = rng.choice(["seated", "down", "up", "both"], p=[0.4, 0.2, 0.2, 0.2])
    track = Track(body, rng.uniform(5.0, 9.0))
    times, end_s = track.times, track.times[-1]
    seated = np.ones(len(times))
    lasts = rng.uniform(1.1, 2.4)
    if kind in ("down", "both"):
        start = rng.uniform(0.2, 1.0)
        seated = seated * between(times, start, start + lasts)
    if kind in ("up", "both"):
        seated = seated * (1.0 - between(times, end_s - lasts - 0.4, end_s - 0.4))
    places, heading = stance(body, rng)
    feet = Feet.standing(times, places, heading)
    if kind in ("seated", "both"):
        feet.walk(times, _shuffles(rng, seated, times, places, heading))
    _to_the_seat(rng, track, seated, rng.uniform(0.38, 0.55))
    _lean(rng, track, seated)
    plant(track, feet, rng.uniform(-0.1, 0.25))
    kind = rng.choice(["lap", "one", "both"], p=[0.3, 0.35, 0.35])
    if kind == "both":
        move_arms(rng, track)
        return track
    busy = str(rng.choice(SIDES)) if kind == "one" else ""
    for side in SIDES:
        if side == busy:
            gesture(rng, track, side)
        else:
            quiet_arm(rng, track, side, lap_pose(rng, Shoulder(body, side)))
    return track


def held_by(body: Body, *bones: str) -> np.ndarray:
    """Which vertices follow some bones alone, or nearly so, shape [V]."""
    rows, weight = body.weights
    wanted = np.isin(rows, [bone(name) for name in bones])
    return np.where(wanted, weight, 0.0).sum(axis=1) > 0.9


def seat_below_m(body: Body) -> float:
    """How far the seat is below the pelvis's bone of somebody who sits upright [m]."""
    local = np.tile(np.eye(3), (len(BONES), 1, 1))
    for side in SIDES:
        local[bone(f"upperleg_{side}")] = about(Y, -0.5 * np.pi)
        local[bone(f"lowerleg_{side}")] = about(Y, 0.5 * np.pi)
    world = Pose.from_local(np.zeros(3), local)
    skin = body.skin(Pose(np.zeros(3), world.turns @ body.neutral))
    near = held_by(body, *SEATED) & (np.abs(skin[:, 0]) < 0.2)
    # Flesh gives way by a centimetre or two.
    return float(-skin[near, 2].min()) - 0.015


def _to_the_seat(
    rng: np.random.Generator, track: Track, seated: np.ndarray, height_m: float
) -> None:
    """Moves the root between standing over the feet and sitting behind them."""
    body = track.body
    thigh = body.heads[bone("upperleg_left")] - body.heads[bone("lowerleg_left")]
    back = -float(np.linalg.norm(thigh)) * rng.uniform(0.72, 0.98)
    low = height_m + seat_below_m(body)
    standing = body.heads[0][2] - 0.008 * body.height_m
    low = min(low, standing - 0.12)
    # The seat comes nearer first backwards, then down, so that knees stay behind the toes.
    track.root[:, 0] = back * np.sin(0.5 * np.pi * seated) ** 1.3
    track.root[:, 1] = 0.005 * noise(rng, track.times, 0.3)
    track.root[:, 2] = standing + (low - standing) * seated


def _lean(rng: np.random.Generator, track: Track, seated: np.ndarray) -> None:
    """Pelvis and trunk: far ahead half-way, then upright, slumped or reclined.

    The trunk leans ahead by 30 to 50 degrees as the seat is left (Schenkman et al. 1990).
    """
    times = track.times
    half = 4.0 * seated * (1.0 - seated)
    recline = rng.choice([rng.uniform(-0.35, 0.0), rng.uniform(0.0, 0.35)], p=[0.6, 0.4])
    slump = rng.uniform(0.0, 0.4)
    lively = rng.uniform(0.05, 0.7)
    tilt = rng.uniform(0.35, 0.6) * half + seated * np.clip(recline, -0.4, 0.25)
    track.pelvis(
        0.0,
        tilt + 0.02 * lively * noise(rng, times, 0.3),
        0.05 * lively * seated * noise(rng, times, 0.3),
        0.08 * lively * noise(rng, times, 0.2),
    )
    ahead = slump * seated + 0.25 * half + 0.25 * lively * seated * noise(rng, times, 0.25)
    track.trunk(
        np.clip(ahead, -0.25, 0.9),
        0.15 * lively * noise(rng, times, 0.3),
        0.4 * lively * noise(rng, times, 0.3),
    )
    track.gaze(
        np.clip(-0.6 * tilt - 0.3 * slump * seated + 0.15 * noise(rng, times, 0.3), -0.7, 0.6),
        0.05 * noise(rng, times, 0.3),
        rng.uniform(0.1, 0.6) * noise(rng, times, 0.35),
    )


def _shuffles(
    rng: np.random.Generator, seated: np.ndarray, times: np.ndarray, places: dict, heading: dict
) -> list[Step]:
    """Feet that are put elsewhere while seated and are back before standing up."""
    down = times[seated > 0.98]
    steps: list[Step] = []
    if len(down) < 100:
        return steps
    for side in SIDES:
        time_s = down[0] + rng.uniform(0.0, 1.0) + (0.5 if side == "right" else 0.0)
        while time_s < down[-1] - 1.4 and rng.uniform() < 0.75:
            ahead, aside = rng.uniform(-0.22, 0.3), rng.uniform(-0.05, 0.2)
            place = places[side] + np.array([ahead, SIGN[side] * aside, 0.0])
            turn = heading[side] + SIGN[side] * rng.uniform(-0.1, 0.3)
            lasts = rng.uniform(0.35, 0.7)
            steps.append(Step(side, time_s, time_s + lasts, place, turn, rng.uniform(0.01, 0.06)))
            time_s += lasts + rng.uniform(0.3, 3.0)
        if steps and steps[-1].side == side and seated[-1] < 0.5:
            steps.append(Step(side, down[-1] - 0.6, down[-1], places[side], heading[side], 0.02))
    return steps
