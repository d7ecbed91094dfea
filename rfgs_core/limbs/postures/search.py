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
from jaxtyping import Complex64, Float64

from rfgs_core.articulated import Pose
from rfgs_core.articulated.bones import bone
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.limbs.evidence.body import by_bounces, direct, images_of, posed
from rfgs_core.limbs.evidence.entries import pairs_of
from rfgs_core.limbs.evidence.kernel import Facets, log_evidence
from rfgs_core.limbs.evidence.library import about_z, upright
from rfgs_core.limbs.postures.book import PoseBook, blend
from rfgs_core.measure.observations import Observations
from rfgs_core.worlds.figure import Figure

#: Guesses that are drawn, and how far around the place that was found [m]: of who lies that may be
#: anywhere along the body.
DRAWN, AROUND_M, LYING_AROUND_M = 400, 0.13, 0.3
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
ALPHA, LEAST_NOISE = 0.3, 0.1
#: Cosine of the angle between a trunk and the vertical below which somebody lies, crawls, bows or
#: falls.
_LEANS, _TRUNK = 0.7, bone("spine_middle")


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
        self._images = [images_of(pair, observations.bounds_m, centre) for pair in self._pairs]
        stands = posed(figure, upright(figure.body).moved(self._found), self._pairs)
        self._of_standing = self._bounces(stands.facets)

    def guess(self, pose: Pose, page: int, heading: float, spot: np.ndarray) -> Guess:
        """A guess with its evidence."""
        there = pose.turned(about_z(heading)).moved(spot)
        body = posed(self._figure, there, self._pairs, by_skin=False)
        # Walls mirror who lies as they lie. Of who is upright they mirror somebody standing at the
        # place that was found: with images of their own, upright bodies rise up to 0.2 m above it.
        bounces = self._of_standing if is_upright(there) else self._bounces(body.facets)
        log = [
            log_evidence(pair.change, direct(body, pair, np.zeros(3)) + by_walls, LEAST_NOISE)
            for pair, by_walls in zip(self._pairs, bounces, strict=True)
        ]
        return Guess(pose, page, heading, spot, np.array(log))

    def drawn(self) -> list[Guess]:
        """Guesses out of the book, facing anywhere, around the place that was found."""
        guesses = []
        for _ in range(DRAWN):
            page = int(self._rng.integers(len(self._book.poses)))
            pose, heading = self._book.poses[page], self._rng.uniform(0.0, 2.0 * np.pi)
            around_m = AROUND_M if is_upright(pose) else LYING_AROUND_M
            spot = self._found + np.append(self._rng.normal(0.0, around_m, 2), 0.0)
            guesses.append(self.guess(pose, page, heading, spot))
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

    def _bounces(self, facets: Facets) -> list[Complex64[np.ndarray, "entry entry"]]:
        """Covariance of what a body sends each pair by way of walls."""
        both = zip(self._pairs, self._images, strict=True)
        return [ALPHA**2 * by_bounces(facets, pair, images) for pair, images in both]

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


def is_upright(pose: Pose) -> bool:
    """Whether the trunk is within 45° of the vertical."""
    return float(pose.turns[_TRUNK, 2, 2]) > _LEANS


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
