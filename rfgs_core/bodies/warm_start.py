# SPDX-License-Identifier: Apache-2.0
"""What goes on from frame to frame: Gaussians move along with their body, the rest is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.bodies.body_prior import Bodies, nearest_axis
from rfgs_core.bodies.motion_density import kept
from rfgs_core.bodies.start import StartCells, StartDensity


@dataclass(frozen=True)
class Moving:
    """Gaussians of a fitted frame, as far as the next one starts from them."""

    points: Float64[np.ndarray, "M 3"]
    """Their means [m]."""
    bodies: Bodies
    """The bodies they belong to."""
    power: Float64[np.ndarray, "M"]
    """Reflected powers."""
    track_id: Int64[np.ndarray, "M"]
    """Numbers that they keep."""
    unused_track: int
    """The first number that no Gaussian has had."""

    @property
    def body(self) -> Int64[np.ndarray, "M"]:
        """Body that each belongs to; −1 where there are none."""
        if len(self.bodies.axes_xy) == 0:
            return np.full(len(self.points), -1, dtype=np.int64)
        return nearest_axis(self.points, self.bodies.axes_xy)


def carry_over(
    before: Moving,
    bodies: Bodies,
    cells: StartCells,
    density: StartDensity,
    fresh: Float64[np.ndarray, "M 3"],
    rng: np.random.Generator,
) -> tuple[Float64[np.ndarray, "M 3"], Int64[np.ndarray, "M"]]:
    """Moves Gaussians along with their bodies; the least supported third of each body is fresh.

    Of each, not of all: somebody whom radio hears less would lose Gaussians in every frame. Whoever
    has sat down, lain down or stood up is drawn anew: no Gaussian of one posture has a place in the
    other.

    Args:
        before: The fitted frame before.
        bodies: The bodies now, in the same order.
        cells: What the channel says around them.
        density: Where all of them are drawn.
        fresh: Points drawn from it [m].
        rng: Draws who has changed posture.

    Returns:
        Points [m], and their track numbers.
    """
    points = _moved_along(before, bodies)
    changed = (before.bodies.sits != bodies.sits) | (before.bodies.lies != bodies.lies)
    support, fresh_of = density.at(points), nearest_axis(fresh, bodies.axes_xy)
    anew = changed[before.body]
    for body in range(len(bodies)):
        own = np.flatnonzero(before.body == body)
        if changed[body]:
            points[own] = cells.density(bodies.only(body)).draw(len(own), rng)
            continue
        replacing = fresh[fresh_of == body][: len(own) // 3]
        weakest = own[np.argsort(support[own])[: len(replacing)]]
        points[weakest], anew[weakest] = replacing, True
    track_id = before.track_id.copy()
    track_id[anew] = before.unused_track + np.arange(int(anew.sum()))
    return points, track_id


def _moved_along(before: Moving, bodies: Bodies) -> Float64[np.ndarray, "M 3"]:
    """Points that keep their place on a body that walks, or turns on its seat or where it lies."""
    seated = np.nan_to_num(bodies.knees_rad - before.bodies.knees_rad)
    turn = (seated + np.nan_to_num(bodies.ways[:, 0] - before.bodies.ways[:, 0]))[before.body]
    points = before.points.copy()
    x, y = (points[:, :2] - before.bodies.axes_xy[before.body]).T
    turned = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])
    points[:, :2] = turned.T + bodies.axes_xy[before.body]
    return points


def follow_motion(
    before: Moving,
    bodies: Bodies,
    cells: StartCells,
    wanted: Int64[np.ndarray, "body"],
    points: Float64[np.ndarray, "M 3"],
    track_id: Int64[np.ndarray, "M"],
    rng: np.random.Generator,
) -> tuple[Float64[np.ndarray, "N 3"], Int64[np.ndarray, "N"]]:
    """Drops each body's weakest Gaussians, or draws some, until there are as many as wanted."""
    # What came anew has not reflected anything yet.
    power = np.where(np.isin(track_id, before.track_id), before.power, 0.0)
    keep = kept(nearest_axis(points, bodies.axes_xy), power, wanted)
    points, track_id = points[keep], track_id[keep]
    have = np.bincount(nearest_axis(points, bodies.axes_xy), minlength=len(wanted))
    more = [
        cells.density(bodies.only(body)).draw(int(count), rng)
        for body, count in enumerate(wanted - have)
        if count > 0
    ]
    points = np.concatenate([points, *more])
    unused = max(track_id.max(initial=-1) + 1, before.unused_track)
    fresh = unused + np.arange(len(points) - len(track_id))
    return points, np.concatenate([track_id, fresh])
