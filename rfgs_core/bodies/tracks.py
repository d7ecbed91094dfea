# SPDX-License-Identifier: Apache-2.0
"""Where bodies are and where they will be: constant velocity between frames of any distance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from rfgs_core.bodies.body_prior import Bodies

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
    knees_rad: Float64[np.ndarray, "body"]
    """Where the knees of who sits point, see `Bodies`; NaN of everybody else."""
    lying: Float64[np.ndarray, "body 2"] | None = None
    """How those lie who do, see `Bodies`; None where nobody does."""

    @staticmethod
    def begun(axes_xy: Float64[np.ndarray, "body 2"], time_s: float) -> Tracks:
        """Tracks of one frame, of bodies that stand, velocities unknown."""
        unknown = np.full_like(axes_xy, np.nan)
        return Tracks(axes_xy, unknown, time_s, np.full(len(axes_xy), np.nan))

    @property
    def bodies(self) -> Bodies:
        """The bodies as they hold themselves."""
        return Bodies(self.axes_xy, self.knees_rad, self.lying)

    def expected(
        self, time_s: float
    ) -> tuple[Float64[np.ndarray, "body 2"], Float64[np.ndarray, "body"]]:
        """Where bodies will be if they walk on, and how far around to look [m]."""
        known = np.isfinite(self.velocity_xy).all(axis=1)
        velocity = np.where(known[:, None], self.velocity_xy, 0.0)
        elapsed_s = time_s - self.time_s
        doubt_m_s = np.where(known, TURNING_M_S, FASTEST_M_S)
        return self.axes_xy + elapsed_s * velocity, REACH_M + abs(elapsed_s) * doubt_m_s

    def laid(self, bodies: Bodies) -> Tracks:
        """The same tracks where some are found to lie, who do not walk.

        Args:
            bodies: The same bodies, those who lie where they do.
        """
        velocity_xy = np.where(bodies.lies[:, None], 0.0, self.velocity_xy)
        return replace(self, axes_xy=bodies.axes_xy, velocity_xy=velocity_xy, lying=bodies.lying)

    def moved(self, axes_xy: Float64[np.ndarray, "body 2"], time_s: float) -> Tracks:
        """The same bodies at another time, held as before."""
        elapsed_s = time_s - self.time_s
        if elapsed_s == 0.0:
            return replace(self, axes_xy=axes_xy)
        velocity_xy = (axes_xy - self.axes_xy) / elapsed_s
        return replace(self, axes_xy=axes_xy, velocity_xy=velocity_xy, time_s=time_s)
