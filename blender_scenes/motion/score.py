# SPDX-License-Identifier: GPL-3.0-or-later
"""Strings pieces of motion together into one: from a list of pieces to a pose at any time.

Every piece begins in the posture the one before it ended in, so nothing jumps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from blender_scenes.motion.footsteps import PlannedSteps, footprint_on
from blender_scenes.motion.gait import Gait, Manner, stand_width_m
from blender_scenes.motion.path import Spot
from blender_scenes.motion.skeleton import Pose, Skeleton
from blender_scenes.motion.walking import walking_pose


@dataclass(frozen=True)
class Figure:
    """Who moves."""

    skeleton: Skeleton
    """Joints of the body."""
    manner: Manner = field(default_factory=Manner)
    """What makes this person's motion differ from another's."""


@dataclass(frozen=True)
class Posture:
    """Where one piece of motion ends and the next begins: at rest."""

    place_m: tuple[float, float]
    """Point on the floor between the ankles [m]."""
    heading_rad: float
    """Heading, counter-clockwise from +x; a person heading 0 looks along +x."""
    floor_m: float = 0.0
    """Height of the floor under the feet [m]."""
    kind: str = "stand"
    """`stand`, `sit` or `lie`."""
    held: Pose | None = None
    """The pose itself, where it is not plain standing."""

    def pose(self, figure: Figure) -> Pose:
        """The pose of this posture."""
        return self.held if self.held is not None else standing_pose(figure, self)

    @property
    def ahead(self) -> np.ndarray:
        """Unit vector of the heading, shape (3,)."""
        return np.array([np.cos(self.heading_rad), np.sin(self.heading_rad), 0.0])

    @property
    def left(self) -> np.ndarray:
        """Unit vector to the left of the heading, shape (3,)."""
        return np.array([-np.sin(self.heading_rad), np.cos(self.heading_rad), 0.0])


@dataclass(frozen=True)
class Clip:
    """One piece of motion, made for one figure and one beginning."""

    label: str
    """Name of the action, as datasets carry it."""
    duration_s: float
    """How long it takes [s]."""
    pose: Callable[[float], Pose]
    """The pose at a time from 0 to `duration_s` [s]."""
    end: Posture
    """Where it ends."""


class Piece(Protocol):
    """Something a person can do."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """The motion of `figure` from `start` on.

        Raises:
            ValueError: The figure cannot do this from there.
        """
        ...


@dataclass(frozen=True)
class Score:
    """All that one person does."""

    figure: Figure
    """Who."""
    parts: tuple[Clip, ...]
    """What, in order."""
    start: Posture
    """Where it begins."""

    @property
    def duration_s(self) -> float:
        """How long all of it takes [s]."""
        return sum(clip.duration_s for clip in self.parts)

    @property
    def end(self) -> Posture:
        """Where it ends."""
        return self.parts[-1].end if self.parts else self.start

    def pose(self, time_s: float) -> Pose:
        """The pose at `time_s` [s] from the beginning, breathing included."""
        clip, local_s = self._at(time_s)
        pose = clip.pose(local_s) if clip else self.end.pose(self.figure)
        return replace(pose, breath=breath_at(time_s, self.figure.manner.breaths_per_min))

    def label(self, time_s: float) -> str:
        """Name of the action at `time_s` [s]."""
        clip, _ = self._at(time_s)
        return clip.label if clip else self.end.kind

    def _at(self, time_s: float) -> tuple[Clip | None, float]:
        """The clip at a time and the time within it; no clip after the last."""
        for clip in self.parts:
            if time_s < clip.duration_s:
                return clip, time_s
            time_s -= clip.duration_s
        return None, time_s


def compose(figure: Figure, start: Posture, pieces: Sequence[Piece]) -> Score:
    """Puts `pieces` one after another, the first from `start`.

    Raises:
        ValueError: A piece cannot begin where the one before it ended.
    """
    parts: list[Clip] = []
    posture = start
    for piece in pieces:
        parts += piece.clips(figure, posture)
        posture = parts[-1].end
    return Score(figure, tuple(parts), start)


def standing_pose(figure: Figure, posture: Posture) -> Pose:
    """Standing with the feet side by side and the arms hanging."""
    gait = Gait(toe_out_rad=figure.manner.toe_out_rad)
    steps = standing_steps(figure, posture)
    return walking_pose(gait, figure.skeleton, steps, steps.last + 2.0)


def standing_steps(figure: Figure, posture: Posture) -> PlannedSteps:
    """The two footprints of someone who stands."""
    spot = Spot(posture.place_m, posture.heading_rad)
    width_m = stand_width_m(figure.skeleton.legs)
    prints = [
        replace(print_, place=print_.place + np.array([0.0, 0.0, posture.floor_m]))
        for print_ in (
            footprint_on(spot, 0.0, number, width_m, figure.manner.toe_out_rad) for number in (0, 1)
        )
    ]
    return PlannedSteps(spot, prints, np.zeros(2), np.zeros(2), stance=0.62, first=0)


def breath_at(time_s: float, per_minute: float) -> float:
    """How full the chest is: in for 40 % of a breath, out for the rest, without a jerk."""
    share = time_s * per_minute / 60 % 1.0
    inhale = 0.4
    along = share / inhale if share < inhale else 1 - (share - inhale) / (1 - inhale)
    return float(0.5 - 0.5 * np.cos(np.pi * along))
