# SPDX-License-Identifier: Apache-2.0
"""Where the surface of a body is likely before the radio is asked: one who stands, sits or lies.

A body is a few limbs, straight lines with a normal distribution around them. One who stands is a
single upright limb, one who lies a level trunk with arms and narrower legs; one who sits has a
trunk, two thighs and two shins, and knees that point somewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
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

    def row(self, body: int) -> list[float]:
        """Numbers for `_likeliest_limb`: start, end, deviation across and upwards, and whose."""
        # An upright limb ends more sharply than it is wide.
        upright = self.start[0] == self.end[0] and self.start[1] == self.end[1]
        up_m = END_FALL_M if upright else self.radius_m
        return [*self.start.tolist(), *self.end.tolist(), self.radius_m, up_m, float(body)]


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
    return _nearest_to_each(np.asarray(points, np.float64), np.asarray(axes_xy, np.float64))


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
    rows = [limb.row(body) for body in range(len(bodies)) for limb in _limbs(bodies, body)]
    return _likeliest_limb(
        np.asarray(points, np.float64), bodies.axes_xy,
        np.array(rows, dtype=np.float64).reshape(-1, 9),
    )  # fmt: skip


def outward_normals(points: Float[np.ndarray, "N 3"], bodies: Bodies) -> Float64[np.ndarray, "N 3"]:
    """Unit directions away from the likeliest limb of the nearest body; see `surface_prior`."""
    return surface_prior(points, bodies)[1]


@numba.njit(cache=True, nogil=True)
def _nearest(point: np.ndarray, axes_xy: np.ndarray) -> int:
    """Which axis is nearest to a point, seen from above; −1 where there is none."""
    whose, least = -1, np.inf
    for body in range(len(axes_xy)):
        x, y = point[0] - axes_xy[body, 0], point[1] - axes_xy[body, 1]
        if x * x + y * y < least:
            whose, least = body, x * x + y * y
    return whose


@numba.njit(cache=True, nogil=True)
def _nearest_to_each(points: np.ndarray, axes_xy: np.ndarray) -> np.ndarray:
    """`_nearest` of every point."""
    whose = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        whose[i] = _nearest(points[i], axes_xy)
    return whose


@numba.njit(cache=True, nogil=True)
def _likeliest_limb(
    points: np.ndarray, axes_xy: np.ndarray, limbs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`surface_prior` of limbs that are rows of numbers, see `_Limb.row`."""
    density, normals = np.full(len(points), -np.inf), np.zeros((len(points), 3))
    off, along, across = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(len(points)):
        whose = _nearest(points[i], axes_xy)
        for limb in limbs:
            if int(limb[8]) != whose:
                continue
            squared_m, share = 0.0, 0.0
            for k in range(3):
                along[k] = limb[3 + k] - limb[k]
                squared_m += along[k] * along[k]
                share += along[k] * (points[i, k] - limb[k])
            share = min(max(share / squared_m, 0.0), 1.0)
            log, ahead = 0.0, 0.0
            for k in range(3):
                off[k] = points[i, k] - limb[k] - share * along[k]
                log -= 0.5 * (off[k] / limb[7 if k == 2 else 6]) ** 2
                ahead += off[k] * along[k] / squared_m
            if log > density[i]:
                density[i] = log
                # Across the limb, also beyond its ends.
                for k in range(3):
                    across[k] = off[k] - ahead * along[k]
                length = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
                for k in range(3):
                    normals[i, k] = across[k] / max(length, 1e-9)
    return density, normals
