# SPDX-License-Identifier: Apache-2.0
"""How many people change the channel: one more is counted as long as the evidence asks for one.

The facets of a body that stands or lies, of random phases, make what a device pair hears a normal
vector (see
`limbs.evidence.kernel`); so do its echoes by way of walls, and noise. Their levels are fitted
together. One more body counts if that raises the log-likelihood by enough, and with most of the
device pairs that would hear it: what bounces off walls, or is left of a body that is modelled
badly, looks like a body at another place to every pair.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.expected_echoes import ExpectedEchoes, middle_of
from rfgs_core.bodies.localise import SEPARATION_M, PairMaps, locate_bodies, pair_maps
from rfgs_core.bodies.lying import bars_around, may_lie
from rfgs_core.bodies.separation import residual_of_bodies
from rfgs_core.bodies.start import LYING_REACH_M
from rfgs_core.limbs.evidence.entries import Pair, pairs_of
from rfgs_core.limbs.evidence.levels import Levels, mean_power
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: Evidence that it takes to count one more [nat], and beside others a share of their median.
TO_COUNT, OF_OTHERS = 20.0, 0.3
#: Share of the device pairs whose evidence rises: beside nobody of all of them, some of which may
#: hear others who are not known yet (gains that drift in an empty room are heard by 8 of 14) …
ALONE_SHARE = 2 / 3
#: … and beside others of those that would hear a body at the place: it would raise their
#: log-likelihood by at least this on average [nat].
PAIR_SHARE, AUDIBLE = 0.75, 5.0
#: A pair does not hear who stands behind another body: within this of the line of sight, and this
#: far behind it, for echoes that linger appear just behind a body [m].
_HIDES_M, _BEHIND_M = 0.3, 0.7
#: With fewer device pairs an echo off a wall cannot be told from a body.
FEWEST_PAIRS = 3
_NOBODY = Bodies.together([])
#: Nobody is looked for beyond so many.
MOST = 8
#: Places where one more is tried: the highest peaks of what remains of the channel …
_CANDIDATES = 3
#: … beside so many more around each body that is known …
_NEAR_KNOWN = 3
#: … and around each of them [m].
_STEPS_M = 0.08 * np.arange(-2, 3)
_HERE_M = np.zeros((1, 3))
_SHIFTS_M = np.array([[x, y, 0.0] for x in _STEPS_M for y in _STEPS_M])
#: Steps from there towards more evidence, at most.
_CLIMBS = 10
#: Turns by which who lies is made likelier, one after the other [rad].
_TURNS_RAD = (0.0, 0.3, -0.3, 0.15, -0.15)
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


def count_bodies(observations: Observations, config: TrainConfig, seed: int) -> list[Gain]:
    """Who is in a frame.

    Args:
        observations: The frame, with phases, of `FEWEST_PAIRS` device pairs or more.
        config: How echoes are taken out before one more is looked for.
        seed: Seed of the Gaussians that stand for these echoes.

    Returns:
        One row per body, in the order in which they were found; none where nobody is.
    """
    return _added(observations, config, seed, MOST, one_more_counts)


def place_bodies(
    observations: Observations, count: int, config: TrainConfig, seed: int
) -> Float64[np.ndarray, "body 2"] | None:
    """Where so many people are likeliest, each beside all others.

    Args:
        observations: The frame.
        count: How many there are.
        config: How echoes are taken out before one more is looked for.
        seed: Seed of the Gaussians that stand for these echoes.

    Returns:
        Places on the ground [m], in the order in which they were found; None where the evidence
        is of fewer, or there are too few device pairs.
    """
    found = _added(observations, config, seed, count, lambda _: True)
    return _bodies(found).axes_xy if len(found) == count else None


def loudest_gain(observations: Observations) -> float:
    """Evidence of an upright body at the highest peak of a frame [nat]; zero where nobody is."""
    if not observations.changed or len(observations.pairs[1]) < FEWEST_PAIRS:
        return 0.0
    place = locate_bodies(pair_maps(observations), observations.bounds_m, 1)
    return gain_near(observations, _NOBODY, Bodies.standing(place)).nat


def _added(
    observations: Observations,
    config: TrainConfig,
    seed: int,
    most: int,
    counts: Callable[[list[Gain]], bool],
) -> list[Gain]:
    """Bodies one after the other, as long as the last one counts."""
    found: list[Gain] = []
    if not observations.changed or len(observations.pairs[1]) < FEWEST_PAIRS:
        return found
    maps = pair_maps(observations)
    while len(found) < most:
        more = _one_more(observations, maps, found, config, seed)
        if more is None or not counts(more):
            break
        found = more
    return found


def settled(observations: Observations, found: list[Gain]) -> list[Gain]:
    """Bodies that were found, each near there where it is likeliest beside all others.

    Args:
        observations: The frame, which need not be the one in which they were found.
        found: The bodies; what they explained is found anew.
    """
    found = list(found)
    for _ in range(_ROUNDS):
        before = _bodies(found).axes_xy
        for body, one in enumerate(found):
            others = _bodies([other for other in found if other is not one])
            again = gain_near(observations, others, one.body)
            found[body] = (
                again if stands_clear(others, again.place_xy) else again._replace(body=one.body)
            )
        if (_bodies(found).axes_xy == before).all():
            break
    return found


def one_more_counts(bodies: list[Gain]) -> bool:
    """Whether the last of some bodies is one, beside the others."""
    *others, last = bodies
    share = OF_OTHERS * float(np.median([one.nat for one in others])) if others else 0.0
    pairs = PAIR_SHARE if others else ALONE_SHARE
    return last.nat >= max(TO_COUNT, share) and last.heard >= pairs


def _one_more(
    observations: Observations,
    maps: PairMaps,
    found: list[Gain],
    config: TrainConfig,
    seed: int,
) -> list[Gain] | None:
    """All bodies and the likeliest of those that may be missing; None where there is none."""
    known = _bodies(found)
    if found:
        maps = pair_maps(residual_of_bodies(observations, maps, known, config, seed))
    # Around who is known are the loudest leavings: peaks there must not use up the candidates.
    peaks = locate_bodies(maps, observations.bounds_m, _CANDIDATES + _NEAR_KNOWN * len(known))
    clear = [place for place in peaks if stands_clear(known, place)][:_CANDIDATES]
    gains = [gain_near(observations, known, Bodies.standing(place[None])) for place in clear]
    best = max(gains, key=lambda gain: gain.nat, default=None)
    if best is None or best.nat < TO_COUNT or not stands_clear(known, best.place_xy):
        return None
    best = climbed(observations, known, best)
    # Beside others who is heard well enough upright needs no second look.
    if not found or not one_more_counts([*found, best]):
        best = _lain(observations, maps, known, best)
    return settled(observations, [*found, best]) if found else [best]


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


def _lain(observations: Observations, maps: PairMaps, known: Bodies, upright: Gain) -> Gain:
    """Somebody as found, or lying near there if that is likelier."""
    axes_xy = np.vstack([known.axes_xy, upright.place_xy])
    if not may_lie(maps, observations.bounds_m, axes_xy, len(known)):
        return upright
    # At which end the head is makes no difference here.
    bars = bars_around(maps, observations.bounds_m, axes_xy, len(known))[::2]
    tries = [gain_near(observations, known, bar, _HERE_M) for bar in bars]
    best = max(tries, key=lambda gain: gain.nat)
    for turn_rad in _TURNS_RAD:
        turned = replace(best.body, lying=best.body.ways + np.array([turn_rad, 0.0]))
        best = max(best, gain_near(observations, known, turned), key=lambda gain: gain.nat)
    return best if best.nat > upright.nat and stands_clear(known, best.place_xy) else upright


def _bodies(found: list[Gain]) -> Bodies:
    return Bodies.together([one.body for one in found])


def stands_clear(known: Bodies, place: Float64[np.ndarray, "2"]) -> bool:
    """Whether a place is `SEPARATION_M` from everybody, and out of reach of who lies.

    What is left of arms and legs that lie otherwise than modelled is heard by most pairs.
    """
    apart_m = np.where(known.lies, LYING_REACH_M, SEPARATION_M)
    return bool((np.linalg.norm(known.axes_xy - place, axis=1) >= apart_m).all())


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
        shifts_m: Places that are tried around there [m].
    """
    floor_m = float(observations.bounds_m[0, 2])
    pairs = pairs_of(observations, middle_of(near, floor_m))
    others = [ExpectedEchoes.at(known.only(body), floor_m, pairs) for body in range(len(known))]
    new = ExpectedEchoes.at(near, floor_m, pairs)
    fits, tried, brightness = [], [], []
    for pair in pairs:
        straight = [body.echoes(pair) for body in others]
        bounces = [body.by_bounces(pair, observations.bounds_m) for body in others]
        fits.append(Levels.fitted(pair.change, [*straight, *bounces]))
        tried.append([new.echoes(pair, shift) for shift in shifts_m])
        brightness += [
            level * pair.scale**2 / mean_power(part)
            for level, part in zip(fits[-1].level[1:], straight, strict=False)
            if part.any() and pair.change.any()
        ]
    rises = [fit.rises(parts) for fit, parts in zip(fits, tried, strict=True)]
    best = int(np.sum(rises, axis=0).argmax())
    by_pair, expected = np.zeros(len(pairs)), np.full(len(pairs), 0.0 if others else np.inf)
    seen = [not _hidden(pair, known, near.axes_xy[0]) for pair in pairs]
    if sum(seen) < FEWEST_PAIRS:
        # Two pairs agree by chance on an echo off a wall: then all have a say.
        seen = [True] * len(pairs)
    for row, (pair, fit) in enumerate(zip(pairs, fits, strict=True)):
        part = tried[row][best]
        with_it = fit.with_part(part)
        if pair.change.any():
            by_pair[row] = with_it.log_likelihood - fit.log_likelihood
        by_pair[row] -= 0.5 * math.log(len(pair.change))
        if others and seen[row]:
            level = float(np.median(brightness or [0.0])) * mean_power(part) / pair.scale**2
            expected[row] = with_it.expected_rise(level)
    there = replace(near, axes_xy=near.axes_xy + shifts_m[best, :2])
    outermost = np.abs(shifts_m[best]).max() == np.abs(shifts_m).max() > 0.0
    return Gain(there, by_pair, expected, bool(outermost))


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
