# SPDX-License-Identifier: GPL-3.0-or-later
"""How a vehicle follows a line: place, steering and the turn of every wheel. NumPy only.

The middle of the fixed axle keeps to the route. Every wheel stands across its line to the centre
of the turn (Ackermann steering), so that it rolls without slipping, and turns by the length that
its own hub travels over its radius.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

#: Height of the ground [m] at places of shape (..., 2).
Ground = Callable[[np.ndarray], np.ndarray]

_STEP_M = 0.001
_STEPS_PER_FRAME = 50
#: Share of a bend over which its curvature builds up, and again over which it fades.
_EASE = 0.3


def flat(places: np.ndarray) -> np.ndarray:
    """Level ground at z = 0."""
    return np.zeros(places.shape[:-1])


class Route:
    """A line on the ground whose curvature never jumps, as nobody turns a wheel at once."""

    def __init__(
        self,
        start_m: tuple[float, float],
        heading_rad: float,
        bends: Sequence[tuple[float, float]],
    ) -> None:
        """Lays the line.

        Args:
            start_m: Where it begins [m].
            heading_rad: Heading there, counter-clockwise from +x [rad].
            bends: Length [m] and change of heading [rad] of each piece; 0 goes straight.
        """
        curvature = [np.zeros(1)]
        for length_m, turn_rad in bends:
            count = max(round(length_m / _STEP_M), 1)
            share = (np.arange(count) + 0.5) / count
            ease = np.clip(np.minimum(share, 1.0 - share) / _EASE, 0.0, 1.0)
            bulge = ease * ease * (3.0 - 2.0 * ease)
            curvature.append(bulge * turn_rad / (bulge.mean() * length_m))
        kappa = np.concatenate(curvature)[1:]
        lengths = [length_m for length_m, _ in bends]
        counts = [max(round(length_m / _STEP_M), 1) for length_m in lengths]
        step = np.repeat(np.divide(lengths, counts), counts)
        self._s = np.concatenate([[0.0], np.cumsum(step)])
        self._heading = heading_rad + np.concatenate([[0.0], np.cumsum(kappa * step)])
        middle = 0.5 * (self._heading[:-1] + self._heading[1:])
        steps = np.stack([np.cos(middle), np.sin(middle)], axis=1) * step[:, None]
        self._places = np.array(start_m) + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, 0)])
        self._middles, self._kappa = self._s[:-1] + 0.5 * step, kappa

    @property
    def length_m(self) -> float:
        """Length of the line [m]."""
        return float(self._s[-1])

    def position(self, s: np.ndarray) -> np.ndarray:
        """Place [m] at length `s` [m], shape (..., 2)."""
        return np.stack([np.interp(s, self._s, self._places[:, i]) for i in range(2)], axis=-1)

    def heading(self, s: np.ndarray) -> np.ndarray:
        """Heading [rad] at length `s` [m], shape of `s`."""
        return np.interp(s, self._s, self._heading)

    def curvature(self, s: np.ndarray) -> np.ndarray:
        """Change of heading per metre [1/m] at length `s` [m]; positive turns left."""
        return np.interp(s, self._middles, self._kappa)


@dataclass(frozen=True)
class Chassis:
    """Where the wheels of a vehicle stand; x is ahead, y to the left, the fixed axle at x = 0."""

    wheels_m: dict[str, tuple[float, float]]
    """Hub of each wheel by name [m]."""
    radius_m: dict[str, float]
    """Radius of each wheel by name [m]."""


@dataclass(frozen=True)
class Motion:
    """A drive, frame by frame."""

    place_m: np.ndarray
    """Ground below the middle of the fixed axle [m], shape (frame, 3)."""
    turn_rad: np.ndarray
    """Roll, pitch (nose down is positive) and heading [rad], shape (frame, 3)."""
    steer_rad: dict[str, np.ndarray]
    """Steering angle of each wheel [rad], positive to the left, shape (frame,)."""
    spin_rad: dict[str, np.ndarray]
    """How far each wheel has rolled [rad], shape (frame,)."""
    lift_m: dict[str, np.ndarray]
    """How far each wheel sits above its place in the chassis [m], shape (frame,)."""


def distances(times_s: np.ndarray, knots: Sequence[tuple[float, float]]) -> np.ndarray:
    """Distance driven [m] at times [s] when the speed runs straight between (time, speed) knots."""
    knot_s, speed = (np.array(column) for column in zip(*knots, strict=True))
    done = np.concatenate([[0.0], np.cumsum(np.diff(knot_s) * 0.5 * (speed[1:] + speed[:-1]))])
    index = np.clip(np.searchsorted(knot_s, times_s, side="right") - 1, 0, len(knot_s) - 2)
    within = times_s - knot_s[index]
    slope = np.diff(speed)[index] / np.diff(knot_s)[index]
    return done[index] + within * (speed[index] + 0.5 * slope * within)


def drive(
    route: Route,
    chassis: Chassis,
    frames: int,
    fps: float,
    knots: Sequence[tuple[float, float]],
    ground: Ground = flat,
) -> Motion:
    """Drives a vehicle along a route.

    Args:
        route: The line its fixed axle keeps to.
        chassis: Its wheels.
        frames: Number of frames.
        fps: Frames per second.
        knots: Speeds [m/s] by time [s]; in between the speed runs straight.
        ground: Height of the ground.
    """
    fine_s = np.arange((frames - 1) * _STEPS_PER_FRAME + 1) / (fps * _STEPS_PER_FRAME)
    s = distances(fine_s, knots)
    kappa, advance = route.curvature(s), np.diff(s, prepend=0.0)
    pick = slice(None, None, _STEPS_PER_FRAME)
    steer, spin, hub_m = {}, {}, {}
    heading = route.heading(s[pick])
    for name, (x, y) in chassis.wheels_m.items():
        # Speed of the hub over that of the fixed axle's middle: v + ω × r.
        forward, sideways = 1.0 - kappa * y, kappa * x
        rolled = np.cumsum(np.hypot(forward, sideways) * advance) / chassis.radius_m[name]
        steer[name] = np.arctan2(sideways, forward)[pick]
        spin[name] = rolled[pick]
        place = route.position(s[pick]) + _turned(np.array([x, y]), heading)
        hub_m[name] = _hub_height(place, heading + steer[name], chassis.radius_m[name], ground)
    base, roll, pitch = _stand(chassis, hub_m)
    lift = {}
    for name, (x, y) in chassis.wheels_m.items():
        lift[name] = hub_m[name] - chassis.radius_m[name] - (base - pitch * x + roll * y)
    return Motion(
        place_m=np.concatenate([route.position(s[pick]), base[:, None]], axis=1),
        turn_rad=np.stack([roll, pitch, heading], axis=1),
        steer_rad=steer,
        spin_rad=spin,
        lift_m=lift,
    )


def _turned(offset: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """An offset in the vehicle's axes as seen from above, shape (frame, 2)."""
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([cos * offset[0] - sin * offset[1], sin * offset[0] + cos * offset[1]], axis=1)


def _hub_height(
    place: np.ndarray, rolling: np.ndarray, radius_m: float, ground: Ground
) -> np.ndarray:
    """Height of a hub [m] whose wheel, a disc, just touches the ground below it."""
    reach = radius_m * np.sin(np.linspace(-1.4, 1.4, 57))
    ahead = np.stack([np.cos(rolling), np.sin(rolling)], axis=1)
    below = ground(place[:, None, :] + reach[None, :, None] * ahead[:, None, :])
    return (below + np.sqrt(radius_m**2 - reach**2)).max(axis=1)


def _stand(
    chassis: Chassis, hub_m: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height, roll and pitch of the plane that fits the feet of all wheels best."""
    rows = [(1.0, y, -x) for x, y in chassis.wheels_m.values()]
    feet = np.stack([hub_m[name] - chassis.radius_m[name] for name in chassis.wheels_m])
    base, roll, pitch = np.linalg.lstsq(np.array(rows), feet, rcond=None)[0]
    return base, roll, pitch
