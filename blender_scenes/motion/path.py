# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines on the floor that people walk along; `s` is the length along a line [m]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np


class Path(Protocol):
    """A line on the floor; beyond its ends it goes on as it ended."""

    @property
    def length_m(self) -> float:
        """Length [m]."""
        ...

    def heading(self, s: np.ndarray | float) -> np.ndarray:
        """Heading at length `s` [m], counter-clockwise from +x [rad], shape of `s`."""
        ...

    def position(self, s: np.ndarray | float) -> np.ndarray:
        """Position on the floor [m] at length `s` [m], shape (..., 2)."""
        ...


@dataclass(frozen=True)
class ArcPath:
    """An arc that is as long before s = 0 as it needs to be."""

    middle_m: tuple[float, float]
    """Point halfway along the walk [m]."""
    middle_heading_rad: float
    """Heading there, counter-clockwise from +x [rad]."""
    length_m: float
    """Length of the walk [m]; s runs from 0 to this."""
    turn_rad: float
    """How much the heading changes over the walk [rad]; negative turns right."""

    def heading(self, s: np.ndarray | float) -> np.ndarray:
        """Heading at length `s` [m], in radians from +x, shape of `s`."""
        share = np.asarray(s, dtype=np.float64) / self.length_m - 0.5
        return self.middle_heading_rad + share * self.turn_rad

    def position(self, s: np.ndarray | float) -> np.ndarray:
        """Position on the floor [m] at length `s` [m], shape (..., 2)."""
        heading, start = self.heading(s), self.middle_heading_rad
        radius = self.length_m / self.turn_rad
        x = self.middle_m[0] + radius * (np.sin(heading) - np.sin(start))
        y = self.middle_m[1] - radius * (np.cos(heading) - np.cos(start))
        return np.stack([x, y], axis=-1)


@dataclass(frozen=True)
class Spot:
    """A path that stays where it is."""

    place_m: tuple[float, float]
    """Position [m]."""
    heading_rad: float
    """Heading, counter-clockwise from +x [rad]."""
    length_m: float = 0.0
    """Always zero."""

    def heading(self, s: np.ndarray | float) -> np.ndarray:
        """The heading, shape of `s`."""
        return np.full(np.shape(s), self.heading_rad)

    def position(self, s: np.ndarray | float) -> np.ndarray:
        """The position [m], shape (..., 2)."""
        return np.broadcast_to(np.array(self.place_m, dtype=np.float64), (*np.shape(s), 2))


class RoundedPath:
    """Straight lines through `points`, with corners rounded to arcs.

    Example:
        >>> path = RoundedPath([(0, 0), (2, 0), (2, 2)], radius_m=0.5)
        >>> round(path.length_m, 3), path.position(path.length_m).round(3).tolist()
        (3.785, [2.0, 2.0])
    """

    def __init__(self, points: Sequence[tuple[float, float]], radius_m: float = 0.6) -> None:
        """Lays the line.

        Args:
            points: Corners [m], the first and last being the ends.
            radius_m: Radius of the arcs [m]; smaller where a leg is too short for it.

        Raises:
            ValueError: There are fewer than two different points, or a corner turns back.
        """
        corners = np.asarray(points, dtype=np.float64)
        legs = np.diff(corners, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        if len(corners) < 2 or (lengths < 1e-6).any():
            raise ValueError(f"expected two or more points that differ, got {points}")
        headings = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
        turns = np.diff(headings)
        if (np.abs(turns) > np.radians(170)).any():
            raise ValueError(f"a corner of {points} turns back; stop there and use Turn")
        # What an arc cuts off a leg on either side of the corner, at most half of the leg.
        cut = radius_m * np.tan(np.abs(turns) / 2)
        cut = np.minimum(cut, 0.5 * np.minimum(lengths[:-1], lengths[1:]))
        before, after = np.append(0.0, cut), np.append(cut, 0.0)
        bent = np.maximum(np.tan(np.abs(turns) / 2), 1e-9)
        arcs = np.where(np.abs(turns) < 1e-6, 2 * cut, cut / bent * np.abs(turns))
        sizes = np.zeros(2 * len(legs) - 1)
        sizes[0::2], sizes[1::2] = lengths - before - after, arcs
        change = np.zeros(len(sizes))
        change[1::2] = turns
        self._sizes, self._change = sizes, change
        self._knots = np.concatenate([[0.0], np.cumsum(sizes)])
        self._headings = headings[0] + np.concatenate([[0.0], np.cumsum(change)])
        starts = [corners[0]]
        for index in range(len(sizes)):
            starts.append(starts[-1] + self._piece(index, np.array(sizes[index])))
        self._starts = np.array(starts)

    @cached_property
    def length_m(self) -> float:
        """Length [m]."""
        return float(self._knots[-1])

    def _piece(self, index: int, along: np.ndarray) -> np.ndarray:
        """Way within one line or arc, `along` [m] from its start, shape (..., 2)."""
        size, start = max(self._sizes[index], 1e-12), self._headings[index]
        half = 0.5 * self._change[index] * along / size
        # A chord: sinc keeps straight lines exact.
        chord = along * np.sinc(half / np.pi)
        return np.stack([chord * np.cos(start + half), chord * np.sin(start + half)], axis=-1)

    def _find(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        index = np.clip(np.searchsorted(self._knots, s, side="right") - 1, 0, len(self._sizes) - 1)
        return index, s - self._knots[index]

    def heading(self, s: np.ndarray | float) -> np.ndarray:
        """Heading at length `s` [m], counter-clockwise from +x [rad], shape of `s`."""
        return np.interp(np.asarray(s, dtype=np.float64), self._knots, self._headings)

    def position(self, s: np.ndarray | float) -> np.ndarray:
        """Position on the floor [m] at length `s` [m], shape (..., 2)."""
        s = np.asarray(s, dtype=np.float64)
        index, along = self._find(s)
        out = np.zeros((*s.shape, 2))
        for piece in np.unique(index):
            chosen = index == piece
            out[chosen] = self._starts[piece] + self._piece(int(piece), along[chosen])
        return out
