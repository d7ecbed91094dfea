# SPDX-License-Identifier: Apache-2.0
"""Where somebody goes: places found in single frames, smoothed, and which way that is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float64

#: Frames this far apart smooth each other [s].
_SMOOTH_S = 1.0
#: Who is as fast as this or faster goes somewhere, and looks there [m/s]; the places found of who
#: stays are off by some 0.1 m.
GOES_M_S = 0.3


class Way(NamedTuple):
    """Where somebody is and goes, frame by frame."""

    xy: Float64[np.ndarray, "frame 2"]
    """Place [m]."""
    heading: Float64[np.ndarray, "frame"]
    """Direction of travel, from x towards y [rad]."""
    speed_m_s: Float64[np.ndarray, "frame"]
    """How fast."""


def way_of(places: Float[np.ndarray, "frame 2"], time_s: Float64[np.ndarray, "frame"]) -> Way:
    """A smooth way through places [m] found at some times.

    Places come from a quadratic through the frames around, velocities from a line: of a
    quadratic they would be wild at either end.
    """
    xy, velocity = np.zeros((len(places), 2)), np.zeros((len(places), 2))
    for frame in range(len(places)):
        near = np.flatnonzero(np.abs(time_s - time_s[frame]) <= _SMOOTH_S + 1e-6)
        since = time_s[near] - time_s[frame]
        xy[frame] = _fit(since, places[near], min(2, len(near) - 1))[0]
        if len(near) > 1:
            velocity[frame] = _fit(since, places[near], 1)[1]
    heading = np.arctan2(velocity[:, 1], velocity[:, 0])
    return Way(xy, heading, np.linalg.norm(velocity, axis=1))


def looks_of(way: Way, time_s: Float64[np.ndarray, "frame"]) -> Float64[np.ndarray, "frame"]:
    """Which way somebody looks: where they go, and while they stay, as when they last or next go.

    While somebody stays, the way that places go is what these are off by.

    Args:
        way: Where they are and go.
        time_s: Times of the frames [s].

    Returns:
        Headings [rad]; of who never goes anywhere, those of the way.
    """
    goes = np.flatnonzero(way.speed_m_s >= GOES_M_S)
    if not len(goes):
        return way.heading
    nearest = np.abs(time_s[:, None] - time_s[goes]).argmin(axis=1)
    return way.heading[goes[nearest]]


def course_of(
    places: Float[np.ndarray, "frame 2"], time_s: Float64[np.ndarray, "frame"]
) -> tuple[Float64[np.ndarray, "frame"], Float64[np.ndarray, "frame"]]:
    """Which way somebody goes [rad] and how fast [m/s], by the places of the frames beside each.

    Also where frames are so far apart in time that `way_of` takes each by itself.
    """
    if len(places) == 1:
        return np.zeros(1), np.zeros(1)
    velocity = np.gradient(np.asarray(places, np.float64), time_s, axis=0)
    return np.arctan2(velocity[:, 1], velocity[:, 0]), np.linalg.norm(velocity, axis=1)


def _fit(since_s: np.ndarray, places: np.ndarray, degree: int) -> np.ndarray:
    """Coefficients [degree + 1, 2] of polynomials through places."""
    return np.linalg.lstsq(since_s[:, None] ** np.arange(degree + 1), places, rcond=None)[0]
