# SPDX-License-Identifier: Apache-2.0
"""All families of motions by name, and the one that is no more than what joints can do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.articulated.bones import bone
from rfgs_core.errors import RfgsError
from rfgs_core.worlds.motion.bending import reach_high, squat
from rfgs_core.worlds.motion.crawling import crawl
from rfgs_core.worlds.motion.curves import Y, about, noise
from rfgs_core.worlds.motion.exercise import exercise
from rfgs_core.worlds.motion.gait import walk, walk_and_gesture
from rfgs_core.worlds.motion.lying import fall, lie
from rfgs_core.worlds.motion.manner import gesture
from rfgs_core.worlds.motion.motion import Motion
from rfgs_core.worlds.motion.sitting import sit
from rfgs_core.worlds.motion.stairs import stairs
from rfgs_core.worlds.motion.standing import gestures, stand
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


_SCRIPTS: dict[str, Callable[[np.random.Generator, Body], Track]] = {
    "walk": walk,
    "stand": stand,
    "gesture": gestures,
    "walk_gesture": walk_and_gesture,
    "sit": sit,
    "squat": squat,
    "reach_high": reach_high,
    "lie": lie,
    "fall": fall,
    "crawl": crawl,
    "stairs": stairs,
    "exercise": exercise,
    "random": free,
}

#: Names of the families.
FAMILIES = tuple(_SCRIPTS)


def random_motion(rng: np.random.Generator, body: Body, family: str) -> Motion:
    """A random motion of a family.

    Args:
        rng: Where chance comes from; the same numbers give the same motion.
        body: Who moves.
        family: One of `FAMILIES`.

    Raises:
        RfgsError: There is no such family.
    """
    if family not in _SCRIPTS:
        raise RfgsError(f"no family of motions {family!r}; there are: {', '.join(FAMILIES)}")
    track = _SCRIPTS[family](rng, body)
    _breathe(rng, track)
    return track.motion(family)


def _breathe(rng: np.random.Generator, track: Track) -> None:
    """Lifts the chest by millimetres, 12 to 20 times a minute; the head stays level."""
    rate_hz, size = rng.uniform(0.2, 0.34), rng.uniform(0.003, 0.012)
    lift = about(Y, -size * np.sin(2.0 * np.pi * (rate_hz * track.times + rng.uniform())))
    for name, turn in (("spine_upper", lift), ("neck", np.swapaxes(lift, 1, 2))):
        track.local[:, bone(name)] = track.local[:, bone(name)] @ turn
