# SPDX-License-Identifier: GPL-3.0-or-later
"""Where feet are put down, and the line that the pelvis glides along above them.

Time is counted in steps: footprint n is touched first at phase n, even numbers are left feet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from blender_scenes.motion.path import Path
from blender_scenes.motion.rotations import smoothstep


@dataclass(frozen=True)
class Footprint:
    """Where one foot stands."""

    place: np.ndarray
    """Ground below the ankle [m], shape (3,)."""
    yaw_rad: float
    """Turn of the foot about the vertical, from the rest pose."""
    landing: float = 1.0
    """How far the toes are up as the heel lands, as a share of the gait's; 0 lands flat."""
    leaving: float = 1.0
    """How far the heel is up as the toes leave, as a share of the gait's."""


@dataclass(frozen=True)
class Guide:
    """Where the pelvis is wanted."""

    place: np.ndarray
    """Position on the plane [m], shape (2,)."""
    floor_m: float
    """Height of the ground below it [m]."""
    heading_rad: float
    """Heading, counter-clockwise from +x."""


class Steps(Protocol):
    """Footprints and guide of one way on foot."""

    first: int
    """Number of the first footprint; its foot and the next one's stand there from the start."""
    last: int
    """Number of the last footprint; its foot and the one before stay."""

    def footprint(self, number: int) -> Footprint:
        """Footprint `number`."""
        ...

    def guide(self, phase: float) -> Guide:
        """Where the pelvis is wanted at `phase`."""
        ...

    def strength(self, phase: float) -> float:
        """How much the body walks: 0 standing, 1 in full stride."""
        ...


def footprint_on(
    path: Path, s: float, number: int, width_m: float, toe_out_rad: float, turn_rad: float = 0.0
) -> Footprint:
    """Footprint `number` beside `path` at length `s` [m], turned with the path and `turn_rad`."""
    heading = float(path.heading(s)) + turn_rad
    outward = -1.0 if number % 2 else 1.0
    left = np.array([-np.sin(heading), np.cos(heading)])
    place = path.position(s) + 0.5 * outward * width_m * left
    yaw = heading + np.pi / 2 + outward * toe_out_rad
    return Footprint(np.append(place, 0.0), yaw)


@dataclass(frozen=True)
class EndlessSteps:
    """Steps of one length along a path, without beginning or end."""

    path: Path
    """Where to."""
    step_m: float
    """Length of a step along the path [m]."""
    stance: float
    """Share of the cycle in which a foot touches the ground."""
    width_m: float
    """Distance between the ankles across the path [m]."""
    toe_out_rad: float
    """Outward turn of the feet."""
    first: int = -(2**31)
    last: int = 2**31

    def footprint(self, number: int) -> Footprint:
        """Footprint `number`, at `number` steps along the path."""
        return footprint_on(self.path, number * self.step_m, number, self.width_m, self.toe_out_rad)

    def guide(self, phase: float) -> Guide:
        """The pelvis passes over a foot in the middle of that foot's stance."""
        s = self.step_m * phase - self.stance * self.step_m
        return Guide(self.path.position(s), 0.0, float(self.path.heading(s)))

    def strength(self, _phase: float) -> float:
        """Always in full stride."""
        return 1.0


@dataclass(frozen=True)
class PlannedSteps:
    """A list of footprints from standing to standing, or with open ends."""

    path: Path
    """Where to."""
    prints: Sequence[Footprint]
    """Footprints in order, left and right alternating."""
    along_m: np.ndarray
    """Length along the path of each footprint [m], shape (N,)."""
    turn_rad: np.ndarray
    """What each footprint turns beyond the path's heading, shape (N,)."""
    stance: float
    """Share of the cycle in which a foot touches the ground."""
    first: int
    """Number of the first footprint: even if it is a left foot."""
    open_start: bool = False
    """In full stride from the beginning."""
    open_end: bool = False
    """In full stride to the end."""

    @property
    def last(self) -> int:
        """Number of the last footprint."""
        return self.first + len(self.prints) - 1

    @property
    def rest_phases(self) -> tuple[float, float]:
        """Phases at which the pelvis sets off and has come to rest."""
        return self.first + self._lag, self.last + 1 + self._lag

    @property
    def _lag(self) -> float:
        """From a foot's first touch until the pelvis is halfway from the foot before it."""
        return self.stance - 0.5

    def footprint(self, number: int) -> Footprint:
        """Footprint `number`."""
        return self.prints[number - self.first]

    def guide(self, phase: float) -> Guide:
        """Uniform cubic B-spline over the points halfway between successive footprints."""
        levels = np.array([step.place[2] for step in self.prints])
        s, turn, floor = (
            _spline(0.5 * (values[1:] + values[:-1]), phase - self._lag - self.first - 1)
            for values in (self.along_m, self.turn_rad, levels)
        )
        return Guide(self.path.position(s), floor, float(self.path.heading(s)) + turn)

    def strength(self, phase: float) -> float:
        """Grows over the first step and a half, fades over the last."""
        start, end = self.rest_phases
        rise = 1.0 if self.open_start else smoothstep((phase - start) / 1.8)
        return rise if self.open_end else rise * smoothstep((end - phase) / 1.8)


def _spline(controls: np.ndarray, at: float) -> float:
    """Uniform cubic B-spline: exact on straight lines, continuous to the second derivative."""
    base = int(np.floor(at))
    t = at - base
    weights = np.array(
        [(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]
    )
    chosen = np.clip(np.arange(base - 1, base + 3), 0, len(controls) - 1)
    return float(weights @ controls[chosen] / 6)
