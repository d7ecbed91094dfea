# SPDX-License-Identifier: Apache-2.0
"""Legs whose feet stand somewhere: footsteps, and the two-bone inverse kinematics of a leg."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.articulated.bones import bone
from rfgs_core.worlds.motion.curves import Y, Z, about, between, smoothed
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.track import SIDES, SIGN, Track

#: Shins lean over the foot no farther than this before the heel rises [rad].
_DORSIFLEXION_RAD = 0.5
#: A raised heel turns about a point so far ahead of the ankle of a person of 1.7 m: between the
#: ball and the tip of the toes, which do not bend [m].
_BALL_M = 0.145
#: The pelvis goes down so long before a leg would be too short [s].
_AHEAD_S = 0.2
#: Legs are never stretched farther than this share of their length.
_STRETCHED = 0.995


@dataclass(frozen=True)
class Step:
    """One foot goes to another place."""

    side: str
    """Which foot."""
    start_s: float
    """When it leaves the floor [s]."""
    end_s: float
    """When it is there [s]."""
    place: np.ndarray
    """Where the foot then stands: x, y and height of the floor [m], shape [3]."""
    heading: float
    """Where it then points [rad]."""
    lift_m: float = 0.06
    """How far it is lifted over the higher of both places [m]."""


@dataclass
class Feet:
    """Where both feet are over time: middle of the ankle over its sole."""

    places: dict[str, np.ndarray]
    """Foot of each side on the floor or in the air [m], shape [T, 3]."""
    heading: dict[str, np.ndarray]
    """Where each points [rad], shape [T]."""
    heel_rad: dict[str, np.ndarray] = field(default_factory=dict)
    """How far each heel is raised by wish [rad], shape [T]."""

    @classmethod
    def standing(
        cls, times: np.ndarray, places: dict[str, np.ndarray], heading: dict[str, float]
    ) -> Feet:
        """Feet that stay where they are."""
        count = len(times)
        return cls(
            {side: np.tile(np.asarray(places[side], np.float64), (count, 1)) for side in SIDES},
            {side: np.full(count, heading[side]) for side in SIDES},
            {side: np.zeros(count) for side in SIDES},
        )

    def walk(self, times: np.ndarray, steps: list[Step]) -> None:
        """Takes steps, in order of time."""
        for step in steps:
            share = between(times, step.start_s, step.end_s)
            place, heading = self.places[step.side], self.heading[step.side]
            # Where the foot was before; everything later is written anew.
            first = place[max(int(step.start_s * RATE_HZ), 0)].copy()
            pointing = heading[max(int(step.start_s * RATE_HZ), 0)]
            later = times > step.start_s
            rise = step.place[2] - first[2]
            up = share + np.sign(rise) * 0.8 * share * (1.0 - share) if rise else share
            arc = 4.0 * step.lift_m * share * (1.0 - share)
            path = first + share[:, None] * (step.place - first)
            path[:, 2] = first[2] + np.clip(up, 0.0, 1.0) * rise + arc
            place[later] = path[later]
            heading[later] = pointing + share[later] * (step.heading - pointing)


def stance(body: Body, rng: np.random.Generator) -> tuple[dict, dict]:
    """Random places [3] of both feet under the hips, and where they point."""
    hip = abs(body.heads[bone("upperleg_left")][1])
    wide = hip * rng.uniform(0.7, 1.7)
    ahead = 0.05 * rng.standard_normal()
    places = {side: np.array([SIGN[side] * ahead, SIGN[side] * wide, 0.0]) for side in SIDES}
    heading = {side: SIGN[side] * rng.uniform(-0.02, 0.3) for side in SIDES}
    return places, heading


def plant(track: Track, feet: Feet, knees_out: float = 0.1) -> None:
    """Bends both legs so that the feet are where they should be; lowers the root to reach.

    The pelvis's rotation and the wished root stand in `track`.

    Args:
        track: Gets legs, and a root that is low enough.
        feet: Where the feet are.
        knees_out: How far knees point outwards of the feet [rad].
    """
    ankles = {side: _ankle(track.body, side, feet, feet.heel_rad[side]) for side in SIDES}
    drop = np.zeros(len(track.times))
    for side in SIDES:
        hip = _hip(track, side)
        reach = _STRETCHED * sum(_lengths(track.body, side))
        flat = np.sum((hip - ankles[side])[:, :2] ** 2, axis=1)
        highest = ankles[side][:, 2] + np.sqrt(np.maximum(reach**2 - flat, 0.01))
        drop = np.maximum(drop, hip[:, 2] - highest)
    track.root[:, 2] -= _over(drop)
    for side in SIDES:
        lean = np.zeros(len(track.times))
        for _ in range(3):
            ankle = _ankle(track.body, side, feet, feet.heel_rad[side] + lean)
            shin = _bend(track, side, ankle, feet.heading[side] + SIGN[side] * knees_out)
            ahead = np.stack([np.cos(feet.heading[side]), np.sin(feet.heading[side])], axis=1)
            forward = np.sum(shin[:, :2, 2] * ahead, axis=1)
            tilt = np.arctan2(forward, shin[:, 2, 2])
            over = np.maximum(tilt - feet.heel_rad[side] - _DORSIFLEXION_RAD, 0.0)
            lean = np.clip(over, 0.0, 1.0)
        pitch = feet.heel_rad[side] + lean
        foot = about(Z, feet.heading[side]) @ about(Y, pitch)
        track.local[:, bone(f"foot_{side}")] = np.swapaxes(shin, 1, 2) @ foot


def _over(values: np.ndarray) -> np.ndarray:
    """A smooth curve [T] that is nowhere below `values`, nor far above."""
    reach = round(_AHEAD_S * RATE_HZ)
    padded = np.pad(values, reach, mode="edge")
    highest = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    return smoothed(highest, RATE_HZ, _AHEAD_S / 2.5)


def _lengths(body: Body, side: str) -> tuple[float, float]:
    """Of thigh and shin [m]."""
    hip, knee, ankle = (body.heads[bone(f"{n}_{side}")] for n in ("upperleg", "lowerleg", "foot"))
    return float(np.linalg.norm(knee - hip)), float(np.linalg.norm(ankle - knee))


def _hip(track: Track, side: str) -> np.ndarray:
    """Place of a hip [T, 3]."""
    step = track.body.heads[bone(f"upperleg_{side}")] - track.body.heads[0]
    return track.root + track.local[:, 0] @ step


def _ankle(body: Body, side: str, feet: Feet, pitch: np.ndarray) -> np.ndarray:
    """Place of an ankle [T, 3] over a foot whose heel is raised by `pitch` [T]."""
    height = body.heads[bone(f"foot_{side}")][2]
    ball = np.array([_BALL_M * body.height_m / 1.7, 0.0, 0.0])
    lifted = ball + about(Y, pitch) @ (np.array([0.0, 0.0, height]) - ball)
    turned = np.einsum("tij,tj->ti", about(Z, feet.heading[side]), lifted)
    return feet.places[side] + turned


def _bend(track: Track, side: str, ankle: np.ndarray, pointing: np.ndarray) -> np.ndarray:
    """Sets thigh and shin; returns the shin's rotation [T, 3, 3] against the world."""
    thigh_m, shin_m = _lengths(track.body, side)
    leg = ankle - _hip(track, side)
    far = np.linalg.norm(leg, axis=1)
    up = -leg / np.maximum(far, 1e-6)[:, None]
    far = np.clip(far, abs(thigh_m - shin_m) + 0.02, _STRETCHED * (thigh_m + shin_m))
    # A knee points where its foot does, and up where the thigh lies level.
    pole = np.stack([np.cos(pointing), np.sin(pointing), np.full(len(far), 0.35)], axis=1)
    left = np.cross(up, pole)
    left /= np.maximum(np.linalg.norm(left, axis=1), 1e-6)[:, None]
    frame = np.stack([np.cross(left, up), left, up], axis=2)
    at_hip = np.arccos(np.clip((thigh_m**2 + far**2 - shin_m**2) / (2 * thigh_m * far), -1, 1))
    inner = (thigh_m**2 + shin_m**2 - far**2) / (2 * thigh_m * shin_m)
    knee = np.pi - np.arccos(np.clip(inner, -1, 1))
    thigh = frame @ about(Y, -at_hip)
    shin = thigh @ about(Y, knee)
    track.local[:, bone(f"upperleg_{side}")] = np.swapaxes(track.local[:, 0], 1, 2) @ thigh
    track.local[:, bone(f"lowerleg_{side}")] = about(Y, knee)
    return shin
