# SPDX-License-Identifier: Apache-2.0
"""Where bodies are and where they will be: constant velocity between frames of any distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

#: A body is looked for at least this far around where it is expected [m].
REACH_M = 0.5
#: Further for every second that has passed: of a body whose velocity is not known yet [m/s] …
FASTEST_M_S = 2.5
#: … and of one that may turn or stop [m/s].
TURNING_M_S = 1.5


@dataclass(frozen=True)
class Tracks:
    """Bodies on the ground at one time; a body keeps its row from frame to frame."""

    axes_xy: Float64[np.ndarray, "body 2"]
    """Positions [m]."""
    velocity_xy: Float64[np.ndarray, "body 2"]
    """Velocities [m/s]; NaN before a second frame."""
    time_s: float
    """When [s]."""

    @staticmethod
    def begun(axes_xy: Float64[np.ndarray, "body 2"], time_s: float) -> Tracks:
        """Tracks of one frame, velocities unknown."""
        return Tracks(axes_xy, np.full_like(axes_xy, np.nan), time_s)

    def expected(
        self, time_s: float
    ) -> tuple[Float64[np.ndarray, "body 2"], Float64[np.ndarray, "body"]]:
        """Where bodies will be if they walk on, and how far around to look [m]."""
        known = np.isfinite(self.velocity_xy).all(axis=1)
        velocity = np.where(known[:, None], self.velocity_xy, 0.0)
        elapsed_s = time_s - self.time_s
        doubt_m_s = np.where(known, TURNING_M_S, FASTEST_M_S)
        return self.axes_xy + elapsed_s * velocity, REACH_M + abs(elapsed_s) * doubt_m_s

    def moved(self, axes_xy: Float64[np.ndarray, "body 2"], time_s: float) -> Tracks:
        """The same bodies at another time."""
        elapsed_s = time_s - self.time_s
        if elapsed_s == 0.0:
            return Tracks(axes_xy, self.velocity_xy, time_s)
        return Tracks(axes_xy, (axes_xy - self.axes_xy) / elapsed_s, time_s)
