# SPDX-License-Identifier: GPL-3.0-or-later
"""Gestures of the hands, as in the Widar recordings, with minimum-jerk strokes.

A stroke of the hand takes the smoothest way there is in time, whatever its shape: the share of
the way after a share τ of the time is 10τ³ − 15τ⁴ + 6τ⁵ (Flash and Hogan, "The coordination of
arm movements", J. Neurosci. 1985).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from blender_scenes.motion.arms import reach
from blender_scenes.motion.score import Clip, Figure, Posture
from blender_scenes.motion.skeleton import SIDES, Pose, Skeleton

#: From the share of a stroke to where the right hand is: arm lengths ahead of the middle between
#: the shoulders, to the right of it and above it.
Curve = Callable[[float], tuple[float, float, float]]


def minimum_jerk(share: float) -> float:
    """Share of the way after a share of the time; `share` is clipped to [0, 1]."""
    t = min(max(share, 0.0), 1.0)
    return t**3 * (10 - 15 * t + 6 * t * t)


def _line(start: tuple[float, float, float], end: tuple[float, float, float]) -> Curve:
    def at(share: float) -> tuple[float, float, float]:
        a, b, c = ((1 - share) * p + share * q for p, q in zip(start, end, strict=True))
        return a, b, c

    return at


def _swing(distance: float, start_deg: float, end_deg: float) -> Curve:
    """A level arc about the right shoulder."""

    def at(share: float) -> tuple[float, float, float]:
        angle = np.radians((1 - share) * start_deg + share * end_deg)
        return distance * np.cos(angle), 0.28 + distance * np.sin(angle), -0.05

    return at


def _circle(radius: float) -> Curve:
    """Once around, clockwise as the person sees it, from the top."""

    def at(share: float) -> tuple[float, float, float]:
        angle = 2 * np.pi * share
        return 0.68, 0.22 + radius * np.sin(angle), radius * np.cos(angle) - 0.05

    return at


def _lines(*corners: tuple[float, float, float]) -> list[Curve]:
    return [_line(a, b) for a, b in pairwise(corners)]


#: Strokes of one repetition of each gesture; a repetition ends where it began.
STROKES: dict[str, list[Curve]] = {
    "push_pull": _lines((0.42, 0.22, -0.10), (0.90, 0.20, 0.0), (0.42, 0.22, -0.10)),
    "sweep": [_swing(0.82, 62, -38), _swing(0.82, -38, 62)],
    "clap": _lines((0.55, 0.42, -0.10), (0.62, 0.045, -0.05), (0.55, 0.42, -0.10)),
    "slide": _lines((0.62, -0.15, -0.12), (0.62, 0.62, -0.12), (0.62, -0.15, -0.12)),
    "draw_o": [_circle(0.32)],
    "draw_zigzag": [
        *_lines(
            *((0.68, -0.12, 0.25), (0.68, 0.52, 0.22), (0.68, -0.08, 0.0), (0.68, 0.52, -0.05)),
            *((0.68, -0.05, -0.30), (0.68, 0.52, -0.33)),
        ),
        _line((0.68, 0.52, -0.33), (0.68, -0.12, 0.25)),
    ],
}


@dataclass(frozen=True)
class Gesture:
    """One of `STROKES`, standing or sitting: the hand rises, makes the strokes and sinks."""

    kind: str
    """`push_pull`, `sweep`, `clap` (both hands), `slide`, `draw_o` or `draw_zigzag`."""
    repeats: int = 1
    """How often the strokes are made."""
    stroke_s: float = 0.0
    """Duration of one stroke [s]; by default 0.7, of a circle 1.8 and of a clap 0.4."""
    hand: str = "R"
    """`R` or `L`; the left hand mirrors the right one."""
    label: str = ""
    """Name of the action; by default the kind."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if self.kind not in STROKES:
            raise ValueError(f"expected a gesture of {', '.join(STROKES)}, got {self.kind!r}")
        if start.kind == "lie":
            raise ValueError("expected to gesture from standing or sitting, not lying")
        stroke_s = self.stroke_s or {"draw_o": 1.8, "clap": 0.4}.get(self.kind, 0.7)
        rest = start.pose(figure)
        hands = [
            _Hand(figure.skeleton, rest, start, side, STROKES[self.kind] * self.repeats, stroke_s)
            for side in (SIDES if self.kind == "clap" else (self.hand,))
        ]

        def pose(time_s: float) -> Pose:
            made = rest
            for hand in hands:
                made = hand.put(made, time_s)
            return made

        return [Clip(self.label or self.kind, hands[0].duration_s, pose, start)]


class _Hand:
    """One hand's way through a gesture: up from where it rests, along the strokes, back."""

    def __init__(
        self,
        skeleton: Skeleton,
        rest: Pose,
        start: Posture,
        side: str,
        strokes: list[Curve],
        stroke_s: float,
    ) -> None:
        self.skeleton, self.side, self._strokes, self._stroke_s = skeleton, side, strokes, stroke_s
        joints = skeleton.joints(rest)
        shoulder, elbow, wrist = (
            joints[skeleton.index[f"{name}.{side}"]]
            for name in ("upperarm01", "lowerarm01", "wrist")
        )
        between = [joints[skeleton.index[f"upperarm01.{name}"]] for name in SIDES]
        self._middle = np.mean(between, axis=0)
        arm_m = np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow)
        outward = start.left * (1.0 if side == "L" else -1.0)
        self._axes = arm_m * np.stack([start.ahead, outward, np.array([0.0, 0.0, 1.0])])
        self._rest_wrist = wrist
        self._rest_elbow = elbow - 0.5 * (shoulder + wrist)
        self._rest_elbow /= np.linalg.norm(self._rest_elbow)
        lowered = 0.75 * outward - 0.25 * start.ahead - np.array([0.0, 0.0, 1.0])
        self._elbow = lowered / np.linalg.norm(lowered)
        way_m = np.linalg.norm(self._point(0, 0.0) - wrist)
        #: Raising takes as long as a relaxed arm needs: about 0.8 m/s on the mean.
        self.raise_s = max(0.5, float(way_m) / 0.8)

    @property
    def duration_s(self) -> float:
        """How long the gesture takes [s]."""
        return 2 * self.raise_s + self._stroke_s * len(self._strokes)

    def _point(self, stroke: int, share: float) -> np.ndarray:
        return self._middle + np.array(self._strokes[stroke](share)) @ self._axes

    def wrist(self, time_s: float) -> tuple[np.ndarray, float]:
        """Where the wrist is wanted [m], and how far the arm has been raised, 0 to 1."""
        local = time_s - self.raise_s
        if local < 0:
            raised = minimum_jerk(time_s / self.raise_s)
            return (1 - raised) * self._rest_wrist + raised * self._point(0, 0.0), raised
        stroke, share = divmod(local / self._stroke_s, 1.0)
        if stroke < len(self._strokes):
            return self._point(int(stroke), minimum_jerk(share)), 1.0
        lowered = minimum_jerk((self.duration_s - time_s) / self.raise_s)
        last = self._point(len(self._strokes) - 1, 1.0)
        return (1 - lowered) * self._rest_wrist + lowered * last, lowered

    def put(self, pose: Pose, time_s: float) -> Pose:
        """`pose` with this hand where it is wanted."""
        wrist, raised = self.wrist(time_s)
        towards = (1 - raised) * self._rest_elbow + raised * self._elbow
        return reach(self.skeleton, pose, self.side, wrist, towards)
