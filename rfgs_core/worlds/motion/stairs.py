# SPDX-License-Identifier: Apache-2.0
"""Up and down stairs, a foot on every step.

Rise and run are those of ordinary stairs; knees bend to 80 to 100 degrees on the way up (Riener,
Rabuffetti and Frigo 2002), which follows from where the feet are.
"""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.articulated.bones import bone
from rfgs_core.worlds.motion.arms import Shoulder, place_arm
from rfgs_core.worlds.motion.curves import Y, about, noise, smoothed
from rfgs_core.worlds.motion.legs import Feet, Step, plant
from rfgs_core.worlds.motion.manner import gesture
from rfgs_core.worlds.motion.motion import RATE_HZ, Plate
from rfgs_core.worlds.motion.standing import sway
from rfgs_core.worlds.motion.track import SIDES, SIGN, Track

#: Treads are boards so thick and wide, and landings reach so far behind or beyond a foot [m].
_THICK_M, _WIDE_M, _LANDING_M = 0.04, 0.8, 0.45
#: A tread begins so far behind the ankle: on the way up half a foot stands on it, so that the
#: toes of the other pass its edge; on the way down the heel does, too [m].
_BEHIND_UP_M, _BEHIND_DOWN_M = 0.02, 0.09
#: Toes do not bend, and dip so far below the sole as a heel is raised [m].
_DIP_M = 0.015


def stairs(rng: np.random.Generator, body: Body) -> Track:
    """Walks up or down three to eight steps, with a little floor before and behind."""
    up = 1.0 if rng.uniform() < 0.5 else -1.0
    count, step_s = int(rng.integers(3, 9)), rng.uniform(0.5, 0.85)
    flat = (int(rng.integers(1, 3)), int(rng.integers(1, 3)))
    track = Track(body, 0.6 + (count + sum(flat) + 1) * step_s + 0.4)
    steps = _steps(rng, body, up, count, flat, step_s)
    wide = 0.6 * abs(body.heads[bone("upperleg_left")][1])
    places = {side: np.array([0.0, SIGN[side] * wide, 0.0]) for side in SIDES}
    toe_out = rng.uniform(0.0, 0.2)
    feet = Feet.standing(track.times, places, {s: SIGN[s] * toe_out for s in SIDES})
    for step in steps:
        step.place[1] = SIGN[step.side] * wide
    feet.walk(
        track.times,
        [
            Step(s.side, s.start_s, s.end_s, s.place, SIGN[s.side] * toe_out, s.lift_m)
            for s in steps
        ],
    )
    for side in SIDES:
        feet.heel_rad[side] = _push_off(track.times, [s for s in steps if s.side == side], up)
    track.plates = _treads(steps[flat[0] : flat[0] + count], steps[-1].place[0], up)
    _body(rng, track, feet, up)
    plant(track, feet, rng.uniform(0.0, 0.15))
    track.floor_m[:] = np.minimum(feet.places["left"][:, 2], feet.places["right"][:, 2])
    _arms(rng, track, feet)
    return track


def _steps(
    rng: np.random.Generator, body: Body, up: float, count: int, flat: tuple[int, int],
    step_s: float,
) -> list[Step]:  # fmt: skip
    """Feet in turn, first on the floor, then on every step, then on the floor again."""
    rise, run = rng.uniform(0.15, 0.19), rng.uniform(0.26, 0.31)
    stride = rng.uniform(0.22, 0.28) * body.height_m
    side, time_s = str(rng.choice(SIDES)), 0.5
    x, z, steps = 0.0, 0.0, []
    for number in range(count + sum(flat) + 1):
        on_stairs = flat[0] <= number < flat[0] + count
        last = number == count + sum(flat)
        x += 0.0 if last else run if on_stairs else stride
        z += up * rise if on_stairs else 0.0
        lift = (0.05 if up > 0 else 0.03) if on_stairs else 0.05
        # A little more than a step's time, so that both feet bear in between.
        lasts = 0.8 * step_s
        steps.append(Step(side, time_s, time_s + lasts, np.array([x, 0.0, z]), 0.0, lift))
        side = SIDES[1 - SIDES.index(side)]
        time_s += step_s
    return steps


def _treads(steps: list[Step], last_x_m: float, up: float) -> tuple[Plate, ...]:
    """A board under every step; the highest is a landing, and the floor itself bears the lowest."""
    behind = _BEHIND_UP_M if up > 0 else _BEHIND_DOWN_M
    begin = [float(step.place[0]) - behind for step in steps]
    height = [float(step.place[2]) for step in steps]
    if up > 0:
        ends = [*begin[1:], last_x_m + _LANDING_M]
    else:
        # The floor above is where the walker starts; the last step is onto the floor below.
        begin, ends = [-_LANDING_M, *begin[:-1]], begin
        height = [0.0, *height[:-1]]
    half = 0.5 * _WIDE_M
    return tuple(
        Plate((low, -half, top - _DIP_M - _THICK_M), (high, half, top - _DIP_M))
        for low, high, top in zip(begin, ends, height, strict=True)
    )


def _push_off(times: np.ndarray, steps: list[Step], up: float) -> np.ndarray:
    """How far a heel is raised before and after it leaves the floor [rad]."""
    out = np.zeros(len(times))
    for step in steps:
        middle = step.start_s + 0.1 * (step.end_s - step.start_s)
        width = 0.22 * (step.end_s - step.start_s)
        out += 0.35 * np.exp(-0.5 * ((times - middle) / width) ** 2)
        if up < 0 and step.place[2] < 0:
            # Down the stairs toes come first.
            landing = np.exp(-0.5 * ((times - step.end_s) / width) ** 2)
            out += 0.25 * landing
    return out


def _body(rng: np.random.Generator, track: Track, feet: Feet, up: float) -> None:
    """Pelvis between the feet, nearer to the one that bears; trunk and head."""
    left, right = feet.places["left"], feet.places["right"]
    middle = smoothed(0.5 * (left + right), RATE_HZ, 0.16)
    lower = smoothed(np.minimum(left[:, 2], right[:, 2]), RATE_HZ, 0.16)
    track.root[:, 0] = middle[:, 0] + (0.02 if up > 0 else -0.02)
    # Over the foot that stands while the other is in the air.
    lifted = smoothed(left[:, 2] - right[:, 2], RATE_HZ, 0.12)
    track.root[:, 1] = -0.25 * np.clip(lifted, -0.08, 0.08)
    share = 0.55 if up > 0 else 0.35
    track.root[:, 2] += (1 - share) * lower + share * middle[:, 2] - 0.012 * track.body.height_m
    track.pelvis(0.0, 0.12 if up > 0 else 0.05, 0.3 * np.clip(lifted, -0.15, 0.15), 0.0)
    sway(rng, track, rng.uniform(0.0, 0.2))


def _arms(rng: np.random.Generator, track: Track, feet: Feet) -> None:
    """Arms swing against the legs, hold a rail, or do something else."""
    between_feet = smoothed(feet.places["left"][:, 0] - feet.places["right"][:, 0], RATE_HZ, 0.05)
    size = rng.uniform(0.0, 1.2)
    rail = str(rng.choice([*SIDES, "none", "none"]))
    busy = str(rng.choice([*SIDES, "none", "none", "none"]))
    for side in SIDES:
        shoulder = Shoulder(track.body, side)
        if side == rail:
            way = np.array([0.25, shoulder.sign * rng.uniform(0.2, 0.35), -0.3])
            pose = shoulder.reach(shoulder.place + way, rng.uniform(0.1, 0.5))
            slide = 0.1 * noise(rng, track.times, 0.6)
            place_arm(track, side, pose.shoulder @ about(Y, slide), np.full(len(slide), pose.elbow))
        elif side == busy:
            gesture(rng, track, side)
        else:
            hang = shoulder.hang(0.0, rng.uniform(0.0, 0.08))
            swing = -SIGN[side] * size * np.clip(between_feet, -0.5, 0.5)
            place_arm(track, side, hang.shoulder @ about(Y, -swing), 0.3 + 0.2 * np.abs(swing))
