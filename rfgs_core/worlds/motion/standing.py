# SPDX-License-Identifier: Apache-2.0
"""On both feet: standing, gestures, squats, reaching up."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.worlds.motion.curves import noise
from rfgs_core.worlds.motion.legs import Feet, Step, plant, stance
from rfgs_core.worlds.motion.manner import carry, clap, gesture, quiet_arm
from rfgs_core.worlds.motion.track import SIDES, Track


def stand(rng: np.random.Generator, body: Body) -> Track:
    """Stands: sways by centimetres, shifts the weight, looks around."""
    track = Track(body, rng.uniform(4.0, 10.0))
    _upright(rng, track, rng.uniform(0.0, 0.35))
    for side in SIDES:
        quiet_arm(rng, track, side)
    return track


def gestures(rng: np.random.Generator, body: Body) -> Track:
    """Stands or steps about and moves one or both arms over all they reach."""
    track = Track(body, rng.uniform(4.0, 10.0))
    _upright(rng, track, rng.uniform(0.2, 1.0), stepping=rng.uniform() < 0.3)
    move_arms(rng, track)
    return track


def move_arms(rng: np.random.Generator, track: Track) -> None:
    """One or both arms do something, or both together."""
    kind = rng.choice(["one", "both", "clap", "carry"], p=[0.35, 0.45, 0.1, 0.1])
    first = str(rng.choice(SIDES))
    other = SIDES[1 - SIDES.index(first)]
    if kind == "clap":
        clap(rng, track)
    elif kind == "carry":
        carry(rng, track, both=True)
    else:
        gesture(rng, track, first)
        (gesture if kind == "both" else quiet_arm)(rng, track, other)


def sway(rng: np.random.Generator, track: Track, lively: float) -> None:
    """Bends and turns trunk and head slowly.

    Args:
        rng: Where chance comes from.
        track: Whose trunk.
        lively: From 0, still, to 1, leaning and turning far.
    """
    times = track.times
    stoop = rng.normal(0.05, 0.08)
    track.trunk(
        np.clip(stoop + 0.25 * lively * noise(rng, times, 0.3), -0.25, 0.8),
        0.18 * lively * noise(rng, times, 0.3),
        0.45 * lively * noise(rng, times, 0.3),
    )
    look = rng.uniform(0.1, 0.5)
    track.gaze(
        np.clip(rng.normal(0.0, 0.12) + 0.2 * look * noise(rng, times, 0.3), -0.6, 0.7),
        0.1 * look * noise(rng, times, 0.3),
        1.2 * look * noise(rng, times, 0.35),
    )


def _upright(rng: np.random.Generator, track: Track, lively: float, stepping: bool = False) -> None:
    """Pelvis, trunk, head and legs of somebody on both feet."""
    body, times = track.body, track.times
    places, heading = stance(body, rng)
    feet = Feet.standing(times, places, heading)
    if stepping:
        feet.walk(times, steps_about(rng, track, places, heading))
    follow_feet(rng, track, feet, lively)
    plant(track, feet, rng.uniform(0.0, 0.2))


def follow_feet(rng: np.random.Generator, track: Track, feet: Feet, lively: float) -> None:
    """Pelvis between both feet, with sway and shifted weight; then trunk and head."""
    times = track.times
    middle = 0.5 * (feet.places["left"] + feet.places["right"])
    between_feet = feet.places["left"] - feet.places["right"]
    # Weight on one leg moves the pelvis over it and drops the other side.
    shift = np.clip(rng.uniform(0.0, 0.35) * noise(rng, times, 0.25), -0.4, 0.4)
    wander = np.stack([noise(rng, times, 0.6), noise(rng, times, 0.6)], axis=1)
    turning = 0.5 * (feet.heading["left"] + feet.heading["right"])
    track.root[:, :2] = (middle + shift[:, None] * between_feet)[:, :2]
    track.root[:, :2] += rng.uniform(0.003, 0.015) * wander
    # Between slack and stretched knees.
    track.root[:, 2] += middle[:, 2] - track.body.height_m * rng.uniform(0.002, 0.012)
    track.pelvis(
        turning,
        0.06 * lively * noise(rng, times, 0.3) + rng.normal(0.0, 0.04),
        0.25 * shift,
        0.12 * lively * noise(rng, times, 0.3),
    )
    sway(rng, track, lively)


def steps_about(rng: np.random.Generator, track: Track, places: dict, heading: dict) -> list[Step]:
    """Random steps in all directions; feet stay apart."""
    wide = places["left"][1] - places["right"][1]
    centre, turn = np.zeros(3), 0.0
    side = str(rng.choice(SIDES))
    steps: list[Step] = []
    time_s = rng.uniform(0.3, 1.5)
    while time_s < track.times[-1] - 0.5:
        if len(steps) % 2 == 0:
            centre = centre + np.append(rng.normal(0.0, 0.13, 2), 0.0)
            turn += rng.normal(0.0, 0.3)
        out = 0.5 * wide * (1.0 if side == "left" else -1.0)
        place = centre + np.array([-np.sin(turn) * out, np.cos(turn) * out, 0.0])
        lasts = rng.uniform(0.35, 0.55)
        steps.append(
            Step(side, time_s, time_s + lasts, place, turn + heading[side], rng.uniform(0.03, 0.1))
        )
        side = SIDES[1 - SIDES.index(side)]
        pause = rng.uniform(0.5, 2.0) if len(steps) % 2 == 0 else rng.uniform(0.05, 0.15)
        time_s += lasts + pause
    return steps
