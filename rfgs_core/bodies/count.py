# SPDX-License-Identifier: Apache-2.0
"""How many people change the channel: one more is counted as long as the evidence asks for one.

One more body counts if it raises the log-likelihood by enough, and with most of the device pairs
that would hear it: what bounces off walls, or is left of a body that is modelled badly, looks like
a body at another place to every pair.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.gain import (
    FEWEST_PAIRS,
    HERE_M,
    NOBODY,
    Gain,
    bodies_of,
    climbed,
    gain_near,
    settled,
    stands_clear,
)
from rfgs_core.bodies.localise import PairMaps, locate_bodies, pair_maps
from rfgs_core.bodies.lying import bars_around, may_lie
from rfgs_core.bodies.separation import residual_of_bodies
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: Evidence that it takes to count one more [nat], and beside others a share of their median.
TO_COUNT, OF_OTHERS = 20.0, 0.3
#: Share of the device pairs whose evidence rises: beside nobody of all of them, some of which may
#: hear others who are not known yet (gains that drift in an empty room are heard by 8 of 14) …
ALONE_SHARE = 2 / 3
#: … and beside others of those that would hear a body at the place.
PAIR_SHARE = 0.75
#: Nobody is looked for beyond so many.
MOST = 8
#: Places where one more is tried: the highest peaks of what remains of the channel …
_CANDIDATES = 3
#: … beside so many more around each body that is known.
_NEAR_KNOWN = 3
#: Turns by which who lies is made likelier, one after the other [rad].
_TURNS_RAD = (0.0, 0.3, -0.3, 0.15, -0.15)


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
    return bodies_of(found).axes_xy if len(found) == count else None


def loudest_gain(observations: Observations) -> float:
    """Evidence of an upright body at the highest peak of a frame [nat]; zero where nobody is."""
    if not observations.changed or len(observations.pairs[1]) < FEWEST_PAIRS:
        return 0.0
    place = locate_bodies(pair_maps(observations), observations.bounds_m, 1)
    return gain_near(observations, NOBODY, Bodies.standing(place)).nat


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
    known = bodies_of(found)
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


def _lain(observations: Observations, maps: PairMaps, known: Bodies, upright: Gain) -> Gain:
    """Somebody as found, or lying near there if that is likelier."""
    axes_xy = np.vstack([known.axes_xy, upright.place_xy])
    if not may_lie(maps, observations.bounds_m, axes_xy, len(known)):
        return upright
    # At which end the head is makes no difference here.
    bars = bars_around(maps, observations.bounds_m, axes_xy, len(known))[::2]
    tries = [gain_near(observations, known, bar, HERE_M) for bar in bars]
    best = max(tries, key=lambda gain: gain.nat)
    for turn_rad in _TURNS_RAD:
        turned = replace(best.body, lying=best.body.ways + np.array([turn_rad, 0.0]))
        best = max(best, gain_near(observations, known, turned), key=lambda gain: gain.nat)
    return best if best.nat > upright.nat and stands_clear(known, best.place_xy) else upright
