# SPDX-License-Identifier: Apache-2.0
"""What a body at a place explains of a frame beside others, and where it explains most.

The facets of a body that stands or lies, of random phases, make what a device pair hears a normal
vector (see `limbs.evidence.kernel`); so do its echoes by way of walls, and noise. Their levels are
fitted together.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex64, Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.expected_echoes import ExpectedEchoes, middle_of
from rfgs_core.bodies.localise import SEPARATION_M, standing_room
from rfgs_core.bodies.start import LYING_REACH_M
from rfgs_core.limbs.evidence.entries import Pair, pairs_of
from rfgs_core.limbs.evidence.levels import Levels, mean_power
from rfgs_core.measure.observations import Observations
from rfgs_core.threads import in_threads

#: A pair would hear a body that raises its log-likelihood by at least this on average [nat].
AUDIBLE = 5.0
#: A pair does not hear who stands behind another body: within this of the line of sight, and this
#: far behind it, for echoes that linger appear just behind a body [m].
_HIDES_M, _BEHIND_M = 0.3, 0.7
#: With fewer device pairs an echo off a wall cannot be told from a body.
FEWEST_PAIRS = 3
NOBODY = Bodies.together([])
#: Places that are tried around one [m].
_STEPS_M = 0.08 * np.arange(-2, 3)
HERE_M = np.zeros((1, 3))
_SHIFTS_M = np.array([[x, y, 0.0] for x in _STEPS_M for y in _STEPS_M])
#: Steps from there towards more evidence, at most.
_CLIMBS = 10
#: Times that every body is moved to where it is likeliest beside all others, at most.
_ROUNDS = 3


class Gain(NamedTuple):
    """What a body at a place explains beside others."""

    body: Bodies
    """The one body, where and how it is likeliest."""
    by_pair: Float64[np.ndarray, "pair"]
    """Rise of the log-likelihood of each device pair, less ½ ln of its entries for the level that
    the body adds (Schwarz, Ann. Stat. 6(2), 1978) [nat]."""
    expected: Float64[np.ndarray, "pair"]
    """Rise that a body would cause on average, were it as bright as the others [nat]; zero where
    one of them hides it, infinite beside nobody."""
    leads_on: bool = False
    """Whether the best of the places that were tried is one of the outermost."""

    @property
    def place_xy(self) -> Float64[np.ndarray, "2"]:
        """Where it is [m]."""
        return self.body.axes_xy[0]

    @property
    def nat(self) -> float:
        """Of all device pairs [nat]."""
        return float(self.by_pair.sum())

    @property
    def heard(self) -> float:
        """Share of the device pairs that rise, of those that would hear a body there."""
        audible = self.expected >= AUDIBLE
        return float(np.mean(self.by_pair[audible] > 0.0)) if audible.any() else 0.0


class _Tried(NamedTuple):
    """What one device pair says of a body at some places."""

    pair: Pair
    fit: Levels
    """The levels of the others without it."""
    parts: list[Complex64[np.ndarray, "entry entry"]]
    """Covariance of the body's straight echoes at each place."""
    rises: Float64[np.ndarray, "place"]
    """How much the log-likelihood rises with it, at least [nat]."""
    brightness: list[float]
    """Level of each of the others, over what is expected of it."""


def gain_near(
    observations: Observations,
    known: Bodies,
    near: Bodies,
    shifts_m: Float64[np.ndarray, "shift 3"] = _SHIFTS_M,
) -> Gain:
    """What a body explains beside others, at the best of some places around one.

    Args:
        observations: The frame.
        known: The others.
        near: The one body, about where it is; who lies keeps height and way.
        shifts_m: Places that are tried around there [m]; of those beyond the walls, whose mirrors
            show bodies too, none but the place itself.
    """
    inside = in_room(near.axes_xy + shifts_m[:, :2], observations.bounds_m)
    shifts_m = shifts_m[inside | ~shifts_m.any(axis=1)]
    floor_m = float(observations.bounds_m[0, 2])
    pairs = pairs_of(observations, middle_of(near, floor_m))
    others = [ExpectedEchoes.at(known.only(body), floor_m, pairs) for body in range(len(known))]
    new = ExpectedEchoes.at(near, floor_m, pairs)

    def tried_by(pair: Pair) -> _Tried:
        straight = [body.echoes(pair) for body in others]
        bounces = [body.by_bounces(pair, observations.bounds_m) for body in others]
        fit = Levels.fitted(pair.change, [*straight, *bounces])
        parts = [new.echoes(pair, shift) for shift in shifts_m]
        brightness = [
            level * pair.scale**2 / mean_power(part)
            for level, part in zip(fit.level[1:], straight, strict=False)
            if part.any() and pair.change.any()
        ]
        return _Tried(pair, fit, parts, fit.rises(parts), brightness)

    tried = in_threads(tried_by, pairs)
    best = int(np.sum([one.rises for one in tried], axis=0).argmax())
    bright = [value for one in tried for value in one.brightness] or [0.0]
    seen = [not _hidden(pair, known, near.axes_xy[0]) for pair in pairs]
    if sum(seen) < FEWEST_PAIRS:
        # Two pairs agree by chance on an echo off a wall: then all have a say.
        seen = [True] * len(pairs)

    def gained(row: int) -> tuple[float, float]:
        pair, fit, part = tried[row].pair, tried[row].fit, tried[row].parts[best]
        with_it = fit.with_part(part)
        rise = with_it.log_likelihood - fit.log_likelihood if pair.change.any() else 0.0
        rise -= 0.5 * math.log(len(pair.change))
        if not others:
            return rise, np.inf
        level = float(np.median(bright)) * mean_power(part) / pair.scale**2
        return rise, with_it.expected_rise(level) if seen[row] else 0.0

    by_pair, expected = np.array(in_threads(gained, range(len(pairs)))).reshape(-1, 2).T
    there = replace(near, axes_xy=near.axes_xy + shifts_m[best, :2])
    outermost = np.abs(shifts_m[best]).max() == np.abs(shifts_m).max() > 0.0
    return Gain(there, by_pair, expected, bool(outermost))


def climbed(observations: Observations, known: Bodies, best: Gain) -> Gain:
    """Somebody as found, or where evidence leads from there, as long as it rises.

    It rises over a metre and more towards a body of which the map of what remains has no peak.
    """
    for _ in range(_CLIMBS):
        if not best.leads_on:
            break
        further = gain_near(observations, known, best.body)
        if further.nat <= best.nat or not stands_clear(known, further.place_xy):
            break
        best = further
    return best


def settled(observations: Observations, found: list[Gain]) -> list[Gain]:
    """Bodies that were found, each near there where it is likeliest beside all others.

    Args:
        observations: The frame, which need not be the one in which they were found.
        found: The bodies; what they explained is found anew.
    """
    found = list(found)
    for _ in range(_ROUNDS):
        before = bodies_of(found).axes_xy
        for body, one in enumerate(found):
            others = bodies_of([other for other in found if other is not one])
            again = gain_near(observations, others, one.body)
            found[body] = (
                again if stands_clear(others, again.place_xy) else again._replace(body=one.body)
            )
        if (bodies_of(found).axes_xy == before).all():
            break
    return found


def likelier_upright(
    observations: Observations, bodies: Bodies, axes_xy: Float64[np.ndarray, "body 2"]
) -> Bodies:
    """Several bodies, of whom those stand who explain more that way beside the others.

    Args:
        observations: The frame.
        bodies: The bodies, some of whom are taken to lie.
        axes_xy: Where each was found upright [m].
    """
    for body in np.flatnonzero(bodies.lies):
        others = Bodies.together([bodies.only(k) for k in range(len(bodies)) if k != body])
        stands, lies = Bodies.standing(axes_xy[[body]]), bodies.only(body)
        tried = [gain_near(observations, others, held, HERE_M).nat for held in (stands, lies)]
        if tried[0] > tried[1]:
            parts = [stands if k == body else bodies.only(k) for k in range(len(bodies))]
            bodies = Bodies.together(parts)
    return bodies


def bodies_of(found: list[Gain]) -> Bodies:
    """The bodies of some gains."""
    return Bodies.together([one.body for one in found])


def stands_clear(known: Bodies, place: Float64[np.ndarray, "2"]) -> bool:
    """Whether a place is `SEPARATION_M` from everybody, and out of reach of who lies.

    What is left of arms and legs that lie otherwise than modelled is heard by most pairs.
    """
    apart_m = np.where(known.lies, LYING_REACH_M, SEPARATION_M)
    return bool((np.linalg.norm(known.axes_xy - place, axis=1) >= apart_m).all())


def in_room(
    places_xy: Float64[np.ndarray, "place 2"], bounds_m: Float64[np.ndarray, "2 3"]
) -> Bool[np.ndarray, "place"]:
    """Which places have space for a body within the walls."""
    low, high = standing_room(bounds_m)
    return ((places_xy >= low) & (places_xy <= high)).all(axis=1)


def _hidden(pair: Pair, known: Bodies, place_xy: Float64[np.ndarray, "2"]) -> bool:
    """Whether a body stands between a place and an end of a pair, seen from above."""
    known_xy = known.axes_xy[~known.lies]
    behind_m = np.linalg.norm(known_xy - place_xy, axis=1)
    for end in (pair.tx, pair.rx):
        way = end.centre[:2] - place_xy
        along = np.clip((known_xy - place_xy) @ way / (way @ way), 0.0, 1.0)
        off_m = np.linalg.norm(place_xy + along[:, None] * way - known_xy, axis=1)
        if ((off_m < _HIDES_M) & (behind_m > _BEHIND_M)).any():
            return True
    return False
