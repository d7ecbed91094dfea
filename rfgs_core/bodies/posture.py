# SPDX-License-Identifier: Apache-2.0
"""Whether a body stands or sits, and where its knees point: the likeliest of a few postures.

Gaussians of equal expected power, drawn as for the fit, make the channel of a device pair a normal
vector of covariance s (A Aᴴ + n I), A their responses. Its likelihood, at the best level s and
share of noise n, is exact and needs no reflectivities (the evidence of a linear model; MacKay,
Neural Computation 4(3), 1992). It tells postures apart where powers per height do not, since it
knows which echoes fit together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.bodies.body_prior import Bodies, outward_normals
from rfgs_core.bodies.localise import PairMaps, pair_maps
from rfgs_core.bodies.pair_sample import PairSample, pair_samples
from rfgs_core.bodies.separation import each_alone
from rfgs_core.bodies.start import StartCells, StartDensity
from rfgs_core.measure.observations import Observations
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import in_threads

#: Gaussians that stand for a body.
GAUSSIANS = 1500
#: Entries (links times subcarriers) that are read of all device pairs together, and at most of one
#: at a time. Of few pairs others are read, with other Gaussians, in several rounds: what one round
#: says of a single pair may be 100 nat off.
ENTRIES, MOST_ENTRIES, MOST_ROUNDS = 4096, 256, 4
#: Directions of knees that are tried.
DIRECTIONS = 8
#: Somebody who stands may be this far from the place that was found [m]: legs that point to where
#: the body truly is would otherwise make up for the error.
SHIFTS_M = (0.1, 0.2)
#: What one device pair may say for or against a posture [nat], where there are so many pairs that
#: others can outvote it: furniture that hides legs or trunk, and noise, mislead some without end.
MOST_PER_PAIR, FEWEST_PAIRS = 10.0, 8
#: Evidence that it takes to call somebody seated [nat].
TO_SIT = 15.0


@dataclass(frozen=True)
class PostureEvidence:
    """Entries of a frame, and how likely they are if bodies hold themselves in some way."""

    rounds: list[list[PairSample]]
    """Of each round, entries of each device pair."""
    seed: int
    """Seed of the Gaussians that stand for bodies, the same for all postures."""

    @staticmethod
    def of(observations: Observations, seed: int) -> PostureEvidence:
        """Draws entries: of few device pairs in several rounds."""
        pairs = max(len(observations.pairs[1]), 1)
        rounds = int(np.clip(ENTRIES // (pairs * MOST_ENTRIES), 1, MOST_ROUNDS))
        entries = min(ENTRIES // pairs, MOST_ENTRIES)
        seeds = [sub_seed(seed, number) for number in range(rounds)]
        drawn = [pair_samples(observations, entries, each) for each in seeds]
        return PostureEvidence(drawn, seed)

    def of_density(self, density: StartDensity, bodies: Bodies) -> Float64[np.ndarray, "pair"]:
        """Log evidence of each device pair for bodies whose Gaussians are drawn from a density."""
        logs = []
        for number, samples in enumerate(self.rounds):
            points = density.draw(GAUSSIANS, np.random.default_rng(sub_seed(self.seed, number)))
            normals = outward_normals(points, bodies)
            logs.append([sample.log_likelihood(points, normals) for sample in samples])
        return np.mean(logs, axis=0)

    def lead(self, log: Float64[np.ndarray, "pair"], other: Float64[np.ndarray, "pair"]) -> float:
        """By how much one posture is likelier than another, no pair having all the say [nat]."""
        most = MOST_PER_PAIR if len(self.rounds[0]) >= FEWEST_PAIRS else np.inf
        return float(np.clip(log - other, -most, most).sum())


def tell_postures(
    observations: Observations,
    maps: PairMaps,
    bodies: Bodies,
    config: TrainConfig,
    seed: int,
) -> Bodies:
    """Who stands and who sits, of bodies whose places are known and who do not lie.

    Args:
        observations: The frame; without phases all are taken to stand.
        maps: Its matched-filter maps.
        bodies: Where they are and who of them lies.
        config: How reflectivities are fitted, and whether postures are told at all.
        seed: Seed of the Gaussians that stand for bodies.
    """
    if config.posture == "standing" or observations.kind != "complex":
        return Bodies.standing(bodies.axes_xy)
    axes_xy, knees = bodies.axes_xy, np.full(len(bodies), np.nan)
    for body, alone in enumerate(each_alone(observations, maps, axes_xy, config, seed)):
        if bodies.lies[body]:
            continue
        own_maps = maps if alone is observations else pair_maps(alone)
        knees[body] = _knees(alone, own_maps, axes_xy[[body]], sub_seed(seed, "posture", body))
    return replace(bodies, knees_rad=knees)


def _knees(
    observations: Observations, maps: PairMaps, axis_xy: Float[np.ndarray, "1 2"], seed: int
) -> float:
    """Where the knees of one body point [rad]; NaN if it stands."""
    evidence = PostureEvidence.of(observations, seed)
    cells = StartCells.around(maps, axis_xy, observations.bounds_m)

    def likely(bodies: Bodies) -> Float64[np.ndarray, "pair"]:
        return evidence.of_density(cells.density(bodies), bodies)

    def seated(knees_rad: float) -> Bodies:
        return Bodies(axis_xy, np.array([knees_rad]))

    step = 2 * np.pi / DIRECTIONS
    angles = step * np.arange(DIRECTIONS)
    upright, *sitting = in_threads(likely, [Bodies.standing(axis_xy), *map(seated, angles)])
    best = int(np.argmax([evidence.lead(log, upright) for log in sitting]))
    if evidence.lead(sitting[best], upright) <= TO_SIT:
        return np.nan
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    shifted = [Bodies.standing(axis_xy + far * away) for far in SHIFTS_M for away in around]
    rivals = [upright, *in_threads(likely, shifted)]
    rival = max(rivals, key=lambda log: evidence.lead(log, upright))
    if evidence.lead(sitting[best], rival) <= TO_SIT:
        return np.nan
    between = [step * (best - 0.5), step * (best + 0.5)]
    found = [(sitting[best], angles[best])]
    found += zip(in_threads(likely, [*map(seated, between)]), between, strict=True)
    likeliest = max(found, key=lambda row: evidence.lead(row[0], upright))
    return float(likeliest[1] % (2 * np.pi))
