# SPDX-License-Identifier: Apache-2.0
"""On hands and knees."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.articulated.bones import bone
from rfgs_core.worlds.motion.arms import Shoulder, place_arm
from rfgs_core.worlds.motion.contact import carried
from rfgs_core.worlds.motion.curves import X, Y, Z, about, between, noise, smoothed
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.track import SIDES, SIGN, Track

#: A limb is on the floor for this share of its stride.
_BEARS = 0.62
#: The trunk's pitch is looked for between these [rad].
_PITCH = (0.6, 1.7)


def crawl(rng: np.random.Generator, body: Body) -> Track:
    """Crawls on hands and knees; each hand goes with the knee of the other side."""
    track = Track(body, rng.uniform(4.0, 7.0))
    times = track.times
    going = between(times, 0.2, 1.0) if rng.uniform() < 0.3 else np.ones(len(times))
    stride_s, size = rng.uniform(0.9, 2.0), rng.uniform(0.15, 0.35)
    phase = rng.uniform() + np.cumsum(0.4 + 0.6 * going) / stride_s / RATE_HZ
    spine = rng.uniform(-0.1, 0.35)
    pitch = _pitch(body, spine)
    _limbs(rng, track, phase, size * going, pitch, spine)
    turning = rng.choice([0.0, rng.uniform(-0.4, 0.4)])
    track.local[:, 0] = about(Z, turning * times) @ track.local[:, 0]
    track.root[:, :2] = 0.0
    world = track.world()
    heads = track.heads(world)
    points, weight = [], []
    for side in SIDES:
        for name, late in (("lowerleg", 0.0), ("hand", 0.5)):
            own = (phase + late + (0.5 if side == "right" else 0.0) + 0.04) % 1.0
            bears = between(own, 0.0, 0.08) * (1.0 - between(own, _BEARS, _BEARS + 0.08))
            points.append(heads[:, bone(f"{name}_{side}")])
            weight.append(bears + 1e-6)
    path = carried(np.stack(points, axis=1), np.stack(weight, axis=1))
    track.root[:, :2] = smoothed(path, RATE_HZ, 0.04)
    track.ground(width_s=0.05)
    return track


def _limbs(
    rng: np.random.Generator, track: Track, phase: np.ndarray, size: np.ndarray, pitch: float,
    spine: float,
) -> None:  # fmt: skip
    """Trunk, legs and arms at phases of the left knee's stride."""
    wave = 2.0 * np.pi * phase
    track.pelvis(0.0, pitch, 0.1 * size * np.sin(wave), -0.25 * size * np.cos(wave))
    track.trunk(spine, 0.1 * size * np.cos(wave), 0.25 * size * np.cos(wave))
    look = rng.uniform(0.2, 0.9)
    track.gaze(-look + 0.1 * noise(rng, track.times, 0.3), 0.0, 0.3 * noise(rng, track.times, 0.3))
    elbow, aside = rng.uniform(0.05, 0.3), rng.uniform(0.03, 0.2)
    for side in SIDES:
        late = 0.5 if side == "right" else 0.0
        leg, arm = (_swing((phase + late + more) % 1.0) for more in (0.0, 0.5))
        hip = pitch + size * leg[0] + 0.1 * leg[1]
        track.leg(side, hip, hip - pitch + 0.5 * np.pi + 0.12 * leg[1], -0.75, 0.03, 0.0)
        shoulder = Shoulder(track.body, side)
        flexion = pitch + spine + 0.9 * size * arm[0] + 0.15 * arm[1]
        turn = about(X, aside * shoulder.sign * np.ones(len(phase))) @ about(Y, -flexion)
        place_arm(track, side, turn, elbow + 0.6 * arm[1] * np.minimum(size / 0.1, 1.0))
        # The palm lies on the floor.
        track.local[:, bone(f"hand_{side}")] = about(Y, -0.9 * np.ones(len(phase))) @ about(
            Z, SIGN[side] * 0.2
        )


def _swing(phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far ahead a limb is, from -1 to 1, and how far it is lifted, from 0 to 1."""
    back = phase / _BEARS
    forth = between(phase, _BEARS, 1.0)
    ahead = np.where(phase < _BEARS, 1.0 - 2.0 * back, 2.0 * forth - 1.0)
    lifted = np.where(phase < _BEARS, 0.0, np.sin(np.pi * forth) ** 2)
    return smoothed(ahead, RATE_HZ, 0.04), lifted


def _pitch(body: Body, spine: float) -> float:
    """Tilt of the pelvis with which hands and knees are on one level [rad]."""
    rng = np.random.default_rng(0)
    low, high = _PITCH
    for _ in range(10):
        middle = 0.5 * (low + high)
        track = Track(body, 0.04)
        still = np.full(len(track.times), 0.25)
        _limbs(rng, track, still, np.zeros(len(still)), middle, spine)
        heads = track.heads()[0]
        # Knees are as high over their skin as wrists over palms, about.
        over = heads[bone("hand_left"), 2] - heads[bone("lowerleg_left"), 2] + 0.02
        low, high = (middle, high) if over > 0.0 else (low, middle)
    return 0.5 * (low + high)
