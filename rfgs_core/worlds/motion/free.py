# SPDX-License-Identifier: Apache-2.0
"""Anything a body can do: smooth random joint angles within anatomical limits."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.worlds.motion.curves import noise
from rfgs_core.worlds.motion.manner import gesture
from rfgs_core.worlds.motion.track import SIDES, Track


def free(rng: np.random.Generator, body: Body) -> Track:
    """Every joint wanders at random; the lowest skin is on the floor."""
    track = Track(body, rng.uniform(4.0, 8.0))
    times = track.times
    fast = rng.uniform(0.2, 0.6)

    def within(low: float, high: float) -> np.ndarray:
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        centre = middle + half * rng.uniform(-0.6, 0.6)
        return np.clip(centre + half * rng.uniform(0.1, 0.7) * noise(rng, times, fast), low, high)

    lean = rng.uniform(0.1, 0.9)
    heading = rng.uniform(0.0, 1.0) * noise(rng, times, 0.2)
    track.pelvis(heading - heading[0], within(-lean, lean), within(-0.5 * lean, 0.5 * lean))
    track.trunk(within(-0.3, 1.0), within(-0.4, 0.4), within(-0.6, 0.6))
    track.gaze(within(-0.6, 0.6), within(-0.4, 0.4), within(-1.0, 1.0))
    for side in SIDES:
        track.leg(
            side, within(-0.25, 1.9), within(0.03, 2.0), within(-0.6, 0.35), within(-0.15, 0.6),
            within(-0.3, 0.5),
        )  # fmt: skip
        gesture(rng, track, side, "reach")
    drift = np.stack([noise(rng, times, 0.15), noise(rng, times, 0.15)], axis=1)
    track.root[:, :2] = rng.uniform(0.0, 0.4) * (drift - drift[0])
    track.ground(width_s=0.08)
    return track
