# SPDX-License-Identifier: Apache-2.0
"""Exercises on the spot: jumping jacks, raised knees, kicks, jumps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.worlds.motion.arms import Shoulder, place_arm
from rfgs_core.worlds.motion.contact import bearing_soles, carried, lowest_bears
from rfgs_core.worlds.motion.curves import X, Y, about, between, minimum_jerk, noise, smoothed
from rfgs_core.worlds.motion.manner import gesture, quiet_arm
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.track import SIDES, SIGN, Track

_GRAVITY_M_S2 = 9.81


def exercise(rng: np.random.Generator, body: Body) -> Track:
    """One exercise, again and again."""
    track = Track(body, rng.uniform(4.0, 7.0))
    kind = rng.choice(["jacks", "knees", "kicks", "jumps"])
    {"jacks": _jacks, "knees": _knees, "kicks": _kicks, "jumps": _jumps}[kind](rng, track)
    return track


def _jacks(rng: np.random.Generator, track: Track) -> None:
    """Jumping jacks: legs apart and arms overhead with every other jump."""
    times = track.times
    hz, hop_m = rng.uniform(0.5, 1.1), rng.uniform(0.02, 0.08)
    high, wide = rng.uniform(1.6, 2.7), rng.uniform(0.2, 0.45)
    share = 0.5 * (1.0 - np.cos(2.0 * np.pi * hz * times))
    soft = 0.15 + 0.25 * np.abs(np.cos(2.0 * np.pi * hz * times))
    track.pelvis(0.1 * noise(rng, times, 0.2), 0.05)
    track.trunk(0.05 * soft)
    track.gaze(0.1 * noise(rng, times, 0.3))
    elbow = rng.uniform(0.1, 0.5)
    for side in SIDES:
        track.leg(side, 0.5 * soft + 0.05, soft, 0.5 * soft, -0.05 + wide * share, 0.12)
        hang = Shoulder(track.body, side).hang(0.0)
        lift = about(X, SIGN[side] * high * share) @ about(Y, -0.2 - 0.2 * share)
        place_arm(track, side, lift @ hang.shoulder, elbow + 0.1 * share)
    track.root[:, :2] = 0.02 * np.stack([noise(rng, times, 0.3), noise(rng, times, 0.3)], axis=1)
    track.ground(hop_m * np.sin(2.0 * np.pi * hz * times) ** 2)


def _knees(rng: np.random.Generator, track: Track) -> None:
    """Raises the knees in turn."""
    hz, high = rng.uniform(0.35, 1.0), rng.uniform(0.7, 1.7)
    _in_turn(rng, track, hz, high, lambda up: 1.25 * high * up, 0.0)


def _kicks(rng: np.random.Generator, track: Track) -> None:
    """Kicks ahead or aside: the knee bends first and is stretched at the top."""
    hz, high = rng.uniform(0.3, 0.55), rng.uniform(0.6, 1.4)
    aside = rng.choice([0.0, rng.uniform(0.3, 0.8)])
    _in_turn(rng, track, hz, high, lambda up: 4.2 * up * (1.0 - up) * high + 0.1, aside)


def _in_turn(
    rng: np.random.Generator, track: Track, hz: float, high: float,
    knee: Callable[[np.ndarray], np.ndarray], aside: float,
) -> None:  # fmt: skip
    """Lifts one leg after the other, or always the same, and stands on the other one.

    Args:
        rng: Where chance comes from.
        track: Whose legs.
        hz: Cycles per second [1/s].
        high: Flexion of the hip at the top [rad].
        knee: Flexion of the lifted knee [rad] at a share of the way up.
        aside: Abduction of the hip at the top [rad].
    """
    times = track.times
    cycle = hz * times
    same = rng.choice(["both", "left", "right"], p=[0.7, 0.15, 0.15])
    lifted = {}
    for side in SIDES:
        own = (cycle + (0.5 if side == "right" else 0.0)) % 1.0
        # Up within the first quarter of the cycle, down within the second.
        up = minimum_jerk(own / 0.25) * (1.0 - minimum_jerk((own - 0.25) / 0.25))
        lifted[side] = up if same in ("both", side) else np.zeros(len(times))
    over = lifted["left"] - lifted["right"]
    lean = rng.uniform(-0.15, 0.2)
    track.pelvis(0.0, 0.05 - 0.12 * (lifted["left"] + lifted["right"]), -0.07 * over, 0.1 * over)
    track.trunk(lean * (lifted["left"] + lifted["right"]) + 0.05, 0.06 * over, -0.15 * over)
    track.gaze(0.1 * noise(rng, times, 0.3), 0.0, 0.2 * noise(rng, times, 0.3))
    for side in SIDES:
        up = lifted[side]
        other = lifted[SIDES[1 - SIDES.index(side)]]
        hip = 0.06 + high * up * (1.0 - 0.5 * min(aside, 1.0))
        bent = 0.08 + 0.12 * other
        track.leg(side, hip + 0.5 * bent, bent + knee(up) * (up > 0), 0.5 * bent - 0.3 * up,
                  -0.06 + aside * up, 0.12)  # fmt: skip
    _stay(track)
    arms = rng.choice(["swing", "quiet", "gesture"], p=[0.5, 0.25, 0.25])
    size = rng.uniform(0.2, 0.9)
    for side in SIDES:
        if arms == "gesture":
            gesture(rng, track, side)
        elif arms == "quiet":
            quiet_arm(rng, track, side)
        else:
            swing = -SIGN[side] * size * over
            hang = Shoulder(track.body, side).hang(0.0, 0.05)
            elbow = 0.4 + 0.6 * size + 0.3 * swing
            place_arm(track, side, hang.shoulder @ about(Y, -swing), elbow)


def _stay(track: Track) -> None:
    """Keeps the foot that stands where it is, and the body on the floor."""
    track.root[:, :2] = 0.0
    path = carried(*bearing_soles(track, lowest_bears(track)))
    # What creeps away over the repetitions is taken back.
    path -= np.linspace(0.0, 1.0, len(path))[:, None] * path[-1]
    track.root[:, :2] = smoothed(path, RATE_HZ, 0.04)
    track.ground()


def _jumps(rng: np.random.Generator, track: Track) -> None:
    """Squats down, jumps, lands softly; arms swing along."""
    times = track.times
    crouch, rise_m = rng.uniform(0.4, 1.1), rng.uniform(0.05, 0.3)
    speed = np.sqrt(2.0 * _GRAVITY_M_S2 * rise_m)
    air_s = 2.0 * speed / _GRAVITY_M_S2
    down_s, push_s, soft_s = rng.uniform(0.4, 0.8), rng.uniform(0.28, 0.4), rng.uniform(0.2, 0.35)
    bent, above, flight, forth = np.zeros((4, len(times)))
    start = rng.uniform(0.2, 1.0)
    while start + down_s + push_s + air_s + soft_s + 0.5 < times[-1]:
        leaves = start + down_s + push_s
        lands = leaves + air_s
        bent += between(times, start, start + down_s) - between(times, start + down_s, leaves)
        landing = between(times, lands - 0.06, lands + soft_s)
        bent += 0.7 * (landing - between(times, lands + soft_s, lands + soft_s + 0.5))
        since = np.clip(times - leaves, 0.0, air_s)
        above += speed * since - 0.5 * _GRAVITY_M_S2 * since**2
        flight += between(times, leaves - 0.1, leaves) - between(times, lands - 0.08, lands + 0.02)
        # Arms swing back on the way down, ahead with the jump, and home again.
        forth += 0.6 * between(times, start + down_s, leaves) + 0.4 * between(times, leaves, lands)
        forth -= between(times, lands, lands + soft_s + 0.5)
        start = lands + soft_s + 0.5 + rng.uniform(0.0, 1.0)
    bent = np.clip(bent, 0.0, 1.0) * crouch
    track.pelvis(0.0, 0.04 + 0.45 * bent)
    track.trunk(0.03 + 0.35 * bent)
    track.gaze(-0.3 * bent)
    size = rng.uniform(0.2, 0.8)
    for side in SIDES:
        hip = 0.05 + 1.4 * bent
        ankle = np.minimum(0.75 * bent, 0.5) - 0.7 * flight
        track.leg(side, hip, 0.1 + 1.75 * bent, ankle, -0.03, 0.12)
        swing = size * (1.5 * forth - 0.6 * bent / crouch)
        hang = Shoulder(track.body, side).hang(0.0, 0.06)
        place_arm(track, side, hang.shoulder @ about(Y, -swing), 0.3 + 0.3 * np.abs(swing))
    _stay(track)
    track.root[:, 2] += above
