# SPDX-License-Identifier: Apache-2.0
"""How many people change the channel: one more is counted as long as the evidence asks for one.

The facets of a standing body, of random phases, make what a device pair hears a normal vector (see
`limbs.evidence.kernel`); so do its echoes by way of walls, and noise. Their levels are fitted
together. One more body counts if that raises the log-likelihood by enough, and with most of the
device pairs that would hear it: what bounces off walls, or is left of a body that is modelled
badly, looks like a body at another place to every pair.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex64, Float, Float64

from rfgs_core.articulated import people
from rfgs_core.bodies.localise import SEPARATION_M, PairMaps, locate_bodies, pair_maps
from rfgs_core.bodies.separation import residual_of_bodies
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.limbs.evidence.body import Posed, by_bounces, direct, figure_of, posed
from rfgs_core.limbs.evidence.entries import Pair, pairs_of
from rfgs_core.limbs.evidence.levels import Levels, mean_power
from rfgs_core.limbs.evidence.library import about_z, upright
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig
from rfgs_core.worlds.figure import Figure

#: Evidence that it takes to count one more [nat], and beside others a share of their median.
TO_COUNT, OF_OTHERS = 20.0, 0.3
#: Share of the device pairs whose evidence rises, of those that would hear a body at the place:
#: it would raise their log-likelihood by at least this on average [nat].
PAIR_SHARE, AUDIBLE = 0.75, 5.0
#: A pair does not hear who stands behind another body: within this of the line of sight, and this
#: far behind it, for echoes that linger appear just behind a body [m].
_HIDES_M, _BEHIND_M = 0.3, 0.7
#: With fewer device pairs an echo off a wall cannot be told from a body.
FEWEST_PAIRS = 3
#: Nobody is looked for beyond so many.
MOST = 8
#: Places where one more is tried: the highest peaks of what remains of the channel …
_CANDIDATES = 3
#: … and around each of them [m].
_STEPS_M = 0.08 * np.arange(-2, 3)
_SHIFTS_M = np.array([[x, y, 0.0] for x in _STEPS_M for y in _STEPS_M])
#: Times that every body is moved to where it is likeliest beside all others, at most.
_ROUNDS = 3
#: Which way a body faces is not known: it is taken to face both ways [rad].
_HEADINGS_RAD = (0.0, 0.5 * math.pi)


class Gain(NamedTuple):
    """What a body at a place explains beside others."""

    place_xy: Float64[np.ndarray, "2"]
    """Where [m]."""
    by_pair: Float64[np.ndarray, "pair"]
    """Rise of the log-likelihood of each device pair, less ½ ln of its entries for the level that
    the body adds (Schwarz, Ann. Stat. 6(2), 1978) [nat]."""
    expected: Float64[np.ndarray, "pair"]
    """Rise that a body would cause on average, were it as bright as the others [nat]; zero where
    one of them hides it, infinite beside nobody."""

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
    found: list[Gain] = []
    if not observations.changed or len(observations.pairs[1]) < FEWEST_PAIRS:
        return found
    maps = pair_maps(observations)
    while len(found) < MOST:
        more = _one_more(observations, maps, found, config, seed)
        if more is None or not one_more_counts(more):
            break
        found = more
    return found


def one_more_counts(bodies: list[Gain]) -> bool:
    """Whether the last of some bodies is one, beside the others."""
    *others, last = bodies
    share = OF_OTHERS * float(np.median([one.nat for one in others])) if others else 0.0
    return last.nat >= max(TO_COUNT, share) and last.heard >= PAIR_SHARE


def _one_more(
    observations: Observations,
    maps: PairMaps,
    found: list[Gain],
    config: TrainConfig,
    seed: int,
) -> list[Gain] | None:
    """All bodies and the likeliest of those that may be missing; None where there is none."""
    places = _places(found)
    if found:
        maps = pair_maps(residual_of_bodies(observations, maps, places, config, seed))
    gains = [
        gain_near(observations, places, place)
        for place in locate_bodies(maps, observations.bounds_m, _CANDIDATES)
        if _separate(places, place)
    ]
    best = max(gains, key=lambda gain: gain.nat, default=None)
    if best is None or best.nat < TO_COUNT or not _separate(places, best.place_xy):
        return None
    return _settled(observations, [*found, best])


def _settled(observations: Observations, found: list[Gain]) -> list[Gain]:
    """Each body where it is likeliest beside all others."""
    found = list(found)
    for _ in range(_ROUNDS if len(found) > 1 else 0):
        before = _places(found)
        for body in range(len(found)):
            others = np.delete(_places(found), body, axis=0)
            again = gain_near(observations, others, found[body].place_xy)
            if not _separate(others, again.place_xy):
                again = again._replace(place_xy=found[body].place_xy)
            found[body] = again
        if (_places(found) == before).all():
            break
    return found


def _places(found: list[Gain]) -> Float64[np.ndarray, "body 2"]:
    return np.array([one.place_xy for one in found]).reshape(-1, 2)


def _separate(places: Float64[np.ndarray, "body 2"], place: Float64[np.ndarray, "2"]) -> bool:
    """Whether nobody stands within `SEPARATION_M` of a place."""
    return bool((np.linalg.norm(places - place, axis=1) >= SEPARATION_M).all())


def gain_near(
    observations: Observations,
    known_xy: Float[np.ndarray, "body 2"],
    place_xy: Float[np.ndarray, "2"],
) -> Gain:
    """What a body explains beside others, at the best of some places around one.

    Args:
        observations: The frame.
        known_xy: Where the others stand [m].
        place_xy: About where it stands [m].
    """
    floor_m = float(observations.bounds_m[0, 2])
    pairs = pairs_of(observations, _middle(place_xy, floor_m))
    known = [_Standing.at(xy, floor_m, pairs) for xy in known_xy]
    new = _Standing.at(place_xy, floor_m, pairs)
    fits, tried, brightness = [], [], []
    for pair in pairs:
        straight = [body.echoes(pair) for body in known]
        bounces = [body.by_bounces(pair, observations.bounds_m) for body in known]
        fits.append(Levels.fitted(pair.change, [*straight, *bounces]))
        tried.append([new.echoes(pair, shift) for shift in _SHIFTS_M])
        brightness += [
            level * pair.scale**2 / mean_power(part)
            for level, part in zip(fits[-1].level[1:], straight, strict=False)
            if part.any() and pair.change.any()
        ]
    rises = [fit.rises(parts) for fit, parts in zip(fits, tried, strict=True)]
    best = int(np.sum(rises, axis=0).argmax())
    by_pair, expected = np.zeros(len(pairs)), np.full(len(pairs), 0.0 if known else np.inf)
    seen = [not _hidden(pair, known_xy, np.asarray(place_xy)) for pair in pairs]
    if sum(seen) < FEWEST_PAIRS:
        # Two pairs agree by chance on an echo off a wall: then all have a say.
        seen = [True] * len(pairs)
    for row, (pair, fit) in enumerate(zip(pairs, fits, strict=True)):
        part = tried[row][best]
        if pair.change.any():
            by_pair[row] = fit.with_part(part).log_likelihood - fit.log_likelihood
        by_pair[row] -= 0.5 * math.log(len(pair.change))
        if known and seen[row]:
            level = float(np.median(brightness or [0.0])) * mean_power(part) / pair.scale**2
            expected[row] = fit.expected_rise(part, level)
    return Gain(np.asarray(place_xy) + _SHIFTS_M[best, :2], by_pair, expected)


def _hidden(
    pair: Pair, known_xy: Float[np.ndarray, "body 2"], place_xy: Float64[np.ndarray, "2"]
) -> bool:
    """Whether a body stands between a place and an end of a pair, seen from above."""
    behind_m = np.linalg.norm(known_xy - place_xy, axis=1)
    for end in (pair.tx, pair.rx):
        way = end.centre[:2] - place_xy
        along = np.clip((known_xy - place_xy) @ way / (way @ way), 0.0, 1.0)
        off_m = np.linalg.norm(place_xy + along[:, None] * way - known_xy, axis=1)
        if ((off_m < _HIDES_M) & (behind_m > _BEHIND_M)).any():
            return True
    return False


class _Standing(NamedTuple):
    """A body that stands at a place, facing both ways at once."""

    middle: Float64[np.ndarray, "3"]
    """Middle of the body [m]."""
    ways: list[Posed]

    @staticmethod
    def at(xy: Float[np.ndarray, "2"], floor_m: float, pairs: list[Pair]) -> _Standing:
        figure = _figure()
        pose, spot = upright(figure.body), np.array([*xy, floor_m])
        turned = (pose.turned(about_z(heading)).moved(spot) for heading in _HEADINGS_RAD)
        return _Standing(_middle(xy, floor_m), [posed(figure, one, pairs) for one in turned])

    def echoes(
        self, pair: Pair, shift: Float64[np.ndarray, "3"] | None = None
    ) -> Complex64[np.ndarray, "entry entry"]:
        """Covariance of the straight echoes, moved by `shift` [m]."""
        moved = np.zeros(3) if shift is None else shift
        return np.sum([direct(one, pair, moved) for one in self.ways], axis=0)

    def by_bounces(
        self, pair: Pair, bounds_m: Float64[np.ndarray, "2 3"]
    ) -> Complex64[np.ndarray, "entry entry"]:
        """Covariance of the echoes by way of one wall."""
        parts = [by_bounces(one.facets, pair, bounds_m, self.middle) for one in self.ways]
        return np.sum(parts, axis=0)


def _middle(xy: Float[np.ndarray, "2"], floor_m: float) -> Float64[np.ndarray, "3"]:
    return np.array([*xy, floor_m + CENTRE_HEIGHT_M])


@functools.cache
def _figure() -> Figure:
    """The mean body."""
    return figure_of(people().body(np.zeros(0)))
