# SPDX-License-Identifier: Apache-2.0
"""Where the surface of a body is likely before the radio is asked: one who stands, sits or lies.

A body is a few limbs, straight lines with a normal distribution around them. One who stands is a
single upright limb, one who lies a level trunk with arms and narrower legs; one who sits has a
trunk, two thighs and two shins, and knees that point somewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64

#: Standard deviation around the axis of somebody who stands [m].
STANDING_RADIUS_M = 0.20
#: Height of somebody who stands, and who sits [m].
STANDING_HEIGHT_M, SITTING_HEIGHT_M = 1.6, 1.3
#: How fast likelihood falls beyond the ends of an upright limb [m].
END_FALL_M = 0.08
#: Height of a seat [m]; thighs lie on it, the trunk stands on it.
SEAT_M = 0.5
#: Standard deviations around trunk, thighs and shins of somebody who sits [m].
TRUNK_RADIUS_M, THIGH_RADIUS_M, SHIN_RADIUS_M = 0.18, 0.09, 0.08
#: From the axis to the knees, and from the middle to each leg [m].
THIGH_M, LEG_SPREAD_M = 0.42, 0.10
#: Lengths from the hips of who lies to head and feet, and deviations around trunk and legs [m].
LYING_TRUNK_M, LYING_LEGS_M = 0.75, 0.8
LYING_TRUNK_RADIUS_M, LYING_LEGS_RADIUS_M = 0.17, 0.10


@dataclass(frozen=True)
class Bodies:
    """Bodies on the ground and how they hold themselves."""

    axes_xy: Float64[np.ndarray, "body 2"]
    """Where head and trunk are, the hips of who lies, seen from above [m]."""
    knees_rad: Float64[np.ndarray, "body"]
    """Where the knees of who sits point, from x towards y [rad]; NaN of everybody else."""
    lying: Float64[np.ndarray, "body 2"] | None = None
    """Of who lies where the head points, from x towards y [rad], and the height of the body's
    middle above the ground [m]; NaN of everybody else, None where nobody lies."""

    @staticmethod
    def standing(axes_xy: Float[np.ndarray, "body 2"]) -> Bodies:
        """Bodies that all stand."""
        return Bodies(np.asarray(axes_xy, dtype=np.float64), np.full(len(axes_xy), np.nan))

    @staticmethod
    def together(parts: list[Bodies]) -> Bodies:
        """All of some, in their order; nobody of none."""
        if not parts:
            return Bodies.standing(np.zeros((0, 2)))
        return Bodies(
            np.concatenate([part.axes_xy for part in parts]),
            np.concatenate([part.knees_rad for part in parts]),
            np.concatenate([part.ways for part in parts]),
        )

    def __len__(self) -> int:
        return len(self.axes_xy)

    @property
    def sits(self) -> Bool[np.ndarray, "body"]:
        """Who sits."""
        return np.isfinite(self.knees_rad)

    @property
    def lies(self) -> Bool[np.ndarray, "body"]:
        """Who lies."""
        return np.isfinite(self.ways[:, 0])

    @property
    def ways(self) -> Float64[np.ndarray, "body 2"]:
        """`lying` with a row for everybody."""
        return np.full((len(self), 2), np.nan) if self.lying is None else self.lying

    def only(self, body: int) -> Bodies:
        """One of them."""
        lying = None if self.lying is None else self.lying[[body]]
        return Bodies(self.axes_xy[[body]], self.knees_rad[[body]], lying)


@dataclass(frozen=True)
class _Limb:
    """A straight line from `start` to `end` [m], and the deviation around it [m]."""

    start: Float64[np.ndarray, "3"]
    end: Float64[np.ndarray, "3"]
    radius_m: float

    def offsets(self, points: Float[np.ndarray, "N 3"]) -> Float64[np.ndarray, "N 3"]:
        """From the nearest point of the line to each point [m]."""
        along = self.end - self.start
        share = np.clip((points - self.start) @ along / (along @ along), 0.0, 1.0)
        return points - self.start - share[:, None] * along

    def log_density(self, offsets: Float64[np.ndarray, "N 3"]) -> Float64[np.ndarray, "N"]:
        """Unnormalised; an upright limb ends more sharply than it is wide."""
        upright = self.start[0] == self.end[0] and self.start[1] == self.end[1]
        deviation = [self.radius_m, self.radius_m, END_FALL_M if upright else self.radius_m]
        return -0.5 * np.sum((offsets / deviation) ** 2, axis=1)

    def away(self, offsets: Float64[np.ndarray, "N 3"]) -> Float64[np.ndarray, "N 3"]:
        """Across the line, also beyond its ends [m]."""
        along = (self.end - self.start) / np.linalg.norm(self.end - self.start)
        return offsets - np.outer(offsets @ along, along)


def _limbs(bodies: Bodies, body: int) -> list[_Limb]:
    """The limbs of one body; its feet stand on the ground, z = 0."""
    axis = np.append(bodies.axes_xy[body], 0.0)
    up = np.array([0.0, 0.0, 1.0])
    if bodies.lies[body]:
        way_rad, height_m = bodies.ways[body]
        ahead = np.array([np.cos(way_rad), np.sin(way_rad), 0.0])
        hips = axis + height_m * up
        return [
            _Limb(hips, hips + LYING_TRUNK_M * ahead, LYING_TRUNK_RADIUS_M),
            _Limb(hips - LYING_LEGS_M * ahead, hips, LYING_LEGS_RADIUS_M),
        ]
    if not bodies.sits[body]:
        return [_Limb(axis, axis + STANDING_HEIGHT_M * up, STANDING_RADIUS_M)]
    angle = bodies.knees_rad[body]
    ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
    aside = np.array([-ahead[1], ahead[0], 0.0])
    limbs = [_Limb(axis + SEAT_M * up, axis + SITTING_HEIGHT_M * up, TRUNK_RADIUS_M)]
    for side in (-LEG_SPREAD_M, LEG_SPREAD_M):
        hip = axis + side * aside + SEAT_M * up
        knee = hip + THIGH_M * ahead
        limbs.append(_Limb(hip, knee, THIGH_RADIUS_M))
        limbs.append(_Limb(knee - SEAT_M * up, knee, SHIN_RADIUS_M))
    return limbs


def nearest_axis(
    points: Float[np.ndarray, "N 3"], axes_xy: Float[np.ndarray, "body 2"]
) -> Int64[np.ndarray, "N"]:
    """Which body axis is nearest to each point, seen from above."""
    return np.linalg.norm(points[:, None, :2] - axes_xy[None], axis=2).argmin(axis=1)


def surface_prior(
    points: Float[np.ndarray, "N 3"], bodies: Bodies
) -> tuple[Float64[np.ndarray, "N"], Float64[np.ndarray, "N 3"]]:
    """Unnormalised log density of bodies' surfaces, and which way they face.

    A point belongs to the likeliest limb of the body whose axis is nearest.

    Args:
        points: Where [m].
        bodies: Whose surface.

    Returns:
        Log density, and unit normals away from the limb; a normal on the line itself is zero.
    """
    whose = nearest_axis(points, bodies.axes_xy)
    density, normals = np.full(len(points), -np.inf), np.zeros((len(points), 3))
    for body in range(len(bodies)):
        own = np.flatnonzero(whose == body)
        for limb in _limbs(bodies, body):
            offsets = limb.offsets(points[own])
            log = limb.log_density(offsets)
            better = log > density[own]
            density[own[better]] = log[better]
            normals[own[better]] = limb.away(offsets)[better]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return density, normals / np.maximum(length, 1e-9)


def outward_normals(points: Float[np.ndarray, "N 3"], bodies: Bodies) -> Float64[np.ndarray, "N 3"]:
    """Unit directions away from the likeliest limb of the nearest body; see `surface_prior`."""
    return surface_prior(points, bodies)[1]
