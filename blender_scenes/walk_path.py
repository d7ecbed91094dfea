# SPDX-License-Identifier: GPL-3.0-or-later
"""The line a person walks along: a circular arc on the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ArcPath:
    """An arc that is as long before s = 0 as it needs to be; s is its length [m]."""

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
