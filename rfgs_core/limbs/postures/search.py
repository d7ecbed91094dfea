# SPDX-License-Identifier: Apache-2.0
"""Guesses at a pose, a heading and a place in one frame, bred for their evidence.

The evidence of a posed surface is peaked: pose, heading and place are told together, within
some centimetres, or not at all. So guesses are drawn from a book of poses, and the best of them
have offspring: turned and moved a little, with a pose that is alike or on the way to that of
another. Few share a direction, so that none is lost before its place was tried.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from rfgs_core.articulated import Pose
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.limbs.evidence.body import by_bounces, direct, images_of, posed
from rfgs_core.limbs.evidence.entries import pairs_of
from rfgs_core.limbs.evidence.kernel import log_evidence
from rfgs_core.limbs.evidence.library import about_z, upright
from rfgs_core.limbs.postures.book import PoseBook, blend
from rfgs_core.measure.observations import Observations
from rfgs_core.worlds.figure import Figure

#: Guesses that are drawn, and how far around the place that was found [m].
DRAWN, AROUND_M = 400, 0.13
#: Generations: how many have offspring, how many each, how far these turn [rad] and move [m].
GENERATIONS = ((48, 5, 0.26, 0.06), (36, 5, 0.16, 0.04), (24, 6, 0.1, 0.025), (12, 10, 0.07, 0.015))
#: Later generations of guesses that frames take from their neighbours.
LATER = GENERATIONS[2:]
#: Directions that share the best of a generation evenly, and how many each may have at most.
_DIRECTIONS, _SHARE = 8, 6
#: How often offspring take a pose that is alike, and one on the way to another; else their own.
_SWAPPED, _BLENDED = 0.35, 0.4
#: How far on the way.
_ON_THE_WAY = (0.15, 0.6)
#: How often offspring rise or sink, and by how much [m].
_RISES, _RISE_M = 0.3, 0.02
#: Amplitude of echoes by way of walls, and the least share of noise: with less of it evidence is
#: peaked so sharply that the model's own errors decide.
_ALPHA, LEAST_NOISE = 0.3, 0.1


class Guess(NamedTuple):
    """Somebody in a frame."""

    pose: Pose
    """Facing along x, above the origin."""
    page: int
    """Page of the book whose pose it is most of."""
    heading: float
    """Which way it faces [rad]."""
    spot: Float64[np.ndarray, "3"]
    """Where it is on the ground [m]."""
    log: Float64[np.ndarray, "pair"]
    """Evidence of it, by device pair [nat]."""

    @property
    def score(self) -> float:
        """Evidence of all pairs [nat]."""
        return float(self.log.sum())

    @property
    def in_world(self) -> Pose:
        """The pose where it is."""
        return self.pose.turned(about_z(self.heading)).moved(self.spot)


class FrameSearch:
    """The evidence of guesses at one person in one frame."""

    def __init__(
        self,
        observations: Observations,
        axis_xy: Float64[np.ndarray, "2"],
        figure: Figure,
        book: PoseBook,
        rng: np.random.Generator,
    ) -> None:
        """Steers every pair to the place that was found.

        Args:
            observations: The frame, without the echoes of anybody else.
            axis_xy: Where the person was found [m].
            figure: A body with its facets.
            book: Poses to begin with.
            rng: Where chance comes from.
        """
        floor_m = float(observations.bounds_m[0, 2])
        centre = np.array([*axis_xy, floor_m + CENTRE_HEIGHT_M])
        self._figure, self._book, self._rng = figure, book, rng
        self._found = np.array([*axis_xy, floor_m])
        self._pairs = pairs_of(observations, centre)
        stands = posed(figure, upright(figure.body).moved(self._found), self._pairs)
        self._bounces = [
            _ALPHA**2
            * by_bounces(stands.facets, pair, images_of(pair, observations.bounds_m, centre))
            for pair in self._pairs
        ]

    def guess(self, pose: Pose, page: int, heading: float, spot: np.ndarray) -> Guess:
        """A guess with its evidence."""
        there = pose.turned(about_z(heading)).moved(spot)
        body = posed(self._figure, there, self._pairs, by_skin=False)
        log = [
            log_evidence(pair.change, direct(body, pair, np.zeros(3)) + bounces, LEAST_NOISE)
            for pair, bounces in zip(self._pairs, self._bounces, strict=True)
        ]
        return Guess(pose, page, heading, spot, np.array(log))

    def drawn(self) -> list[Guess]:
        """Guesses out of the book, facing anywhere, around the place that was found."""
        guesses = []
        for _ in range(DRAWN):
            page = int(self._rng.integers(len(self._book.poses)))
            heading = self._rng.uniform(0.0, 2.0 * np.pi)
            spot = self._found + np.append(self._rng.normal(0.0, AROUND_M, 2), 0.0)
            guesses.append(self.guess(self._book.poses[page], page, heading, spot))
        return guesses

    def bred(
        self,
        guesses: list[Guess],
        generations: tuple[tuple[int, int, float, float], ...] = GENERATIONS,
    ) -> list[Guess]:
        """Guesses and their offspring, the likeliest first."""
        for parents, children, turn_rad, move_m in generations:
            best = spread_out(guesses, parents)
            for parent in best:
                guesses += [self._child(parent, best, turn_rad, move_m) for _ in range(children)]
        return sorted(guesses, key=lambda guess: -guess.score)

    def standing(self, guesses: list[Guess]) -> Guess:
        """The likeliest of those who stand, at the places and headings of some guesses."""
        stands = upright(self._figure.body)
        spots = [np.append(guess.spot[:2], self._found[2]) for guess in guesses]
        spots.append(self._found)
        headings = [guess.heading for guess in guesses] + [0.0]
        tried = [
            self.guess(stands, 0, heading + half, spot)
            for heading, spot in zip(headings, spots, strict=True)
            for half in (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi)
        ]
        return max(tried, key=lambda guess: guess.score)

    def _child(self, parent: Guess, best: list[Guess], turn_rad: float, move_m: float) -> Guess:
        rng, book = self._rng, self._book
        pose, page, chance = parent.pose, parent.page, rng.uniform()
        like = int(rng.choice(book.alike[page]))
        if chance < _SWAPPED:
            pose, page = book.poses[like], like
        elif chance < _SWAPPED + _BLENDED:
            if rng.uniform() < 0.5:
                other = book.poses[like]
            else:
                other = best[int(rng.integers(len(best)))].pose
            pose = blend(pose, other, rng.uniform(*_ON_THE_WAY))
        rise_m = rng.normal(0.0, _RISE_M) * (rng.uniform() < _RISES)
        spot = parent.spot + np.append(rng.normal(0.0, move_m, 2), rise_m)
        return self.guess(pose, page, parent.heading + rng.normal(0.0, turn_rad), spot)


def spread_out(guesses: list[Guess], count: int) -> list[Guess]:
    """The likeliest, at most a share of them in each direction."""
    best: list[Guess] = []
    taken = np.zeros(_DIRECTIONS, dtype=int)
    for guess in sorted(guesses, key=lambda guess: -guess.score):
        direction = int(guess.heading % (2.0 * np.pi) / (2.0 * np.pi) * _DIRECTIONS) % _DIRECTIONS
        if taken[direction] < max(count // _SHARE, 2):
            taken[direction] += 1
            best.append(guess)
        if len(best) == count:
            break
    return best
