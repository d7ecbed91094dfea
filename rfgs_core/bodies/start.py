# SPDX-License-Identifier: Apache-2.0
"""Where the first Gaussians of a frame are drawn: a body-sized prior times the matched filter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.bodies.body_prior import Bodies, nearest_axis, surface_prior
from rfgs_core.bodies.localise import PairMaps

#: Nothing is drawn further than this from all axes along x or y, where somebody lies, or above
#: this height [m].
REACH_M, LYING_REACH_M, REACH_HEIGHT_M = 0.8, 1.1, 2.1
#: Exponent of the matched filter against the prior, chosen on a room that is not in the demo.
EVIDENCE_EXPONENT = 0.25
#: How much of that moves Gaussians from one height to another: what is below or above the
#: antennas mirrors waves away from them, and answers weaker than a trunk of the same surface.
HEIGHT_EVIDENCE = 0.1
#: Cross-section of a trunk [m²]. Heights and bodies are compared by their likeliest cells of that
#: area: where the matched filter is blurred, equal sums would be too thin to stand out.
CROSS_SECTION_M2 = 0.06
#: Edge of the cells in which the density is taken as even [m].
CELL_M = 0.04


@dataclass(frozen=True)
class StartDensity:
    """Where new Gaussians are drawn: body-sized prior times matched filter, in cubic cells.

    The densest part of a body is about as dense as the prior makes it, in all bodies alike and at
    all heights. The matched filter decides where within a height, and to a small part between
    heights.
    """

    share: Float64[np.ndarray, "x y z"]
    """Probability of each cell."""
    low_m: Float64[np.ndarray, "3"]
    """Lower corner of the first cell [m]."""
    high_m: Float64[np.ndarray, "3"]
    """Upper corner that nothing is drawn beyond [m]."""

    @staticmethod
    def of(maps: PairMaps, bodies: Bodies, bounds_m: Float64[np.ndarray, "2 3"]) -> StartDensity:
        """The density of some bodies."""
        return StartCells.of(maps, bodies, bounds_m).density(bodies)

    def draw(self, count: int, rng: np.random.Generator) -> Float64[np.ndarray, "count 3"]:
        """Positions [m]: cells by chance, anywhere within them."""
        cell = rng.choice(self.share.size, size=count, p=self.share.ravel())
        index = np.stack(np.unravel_index(cell, self.share.shape), axis=1)
        points = self.low_m + (index + rng.uniform(0, 1, (count, 3))) * CELL_M
        # The last cell along an axis may stick out of the scene.
        return np.clip(points, self.low_m, self.high_m)

    def even(self, bodies: Bodies) -> StartDensity:
        """The same with as much for each body: who is heard less takes up no less space.

        Its densest cells alone say little of a body on the slope of another's echo. Evidence of
        postures is taken without this, since a body that sits shows less of itself.
        """
        if len(bodies) < 2:
            return self
        cells = np.moveaxis(np.indices(self.share.shape), 0, -1).reshape(-1, 3)
        whose = nearest_axis(self.low_m + (cells + 0.5) * CELL_M, bodies.axes_xy)
        sums = np.bincount(whose, weights=self.share.ravel(), minlength=len(bodies))
        share = self.share * (1.0 / np.maximum(sums, 1e-300))[whose].reshape(self.share.shape)
        return replace(self, share=share / share.sum())

    def at(self, points: Float[np.ndarray, "N 3"]) -> Float64[np.ndarray, "N"]:
        """Probability of the cells that points lie in, zero outside of all."""
        index = np.floor((points - self.low_m) / CELL_M).astype(int)
        inside = ((index >= 0) & (index < self.share.shape)).all(axis=1)
        index = np.where(inside[:, None], index, 0)
        return np.where(inside, self.share[tuple(index.T)], 0.0)


@dataclass(frozen=True)
class StartCells:
    """Cells around some axes and what the matched filter says there, however bodies hold there."""

    points: Float64[np.ndarray, "x y z 3"]
    """Centres of the cells [m]."""
    evidence: Float64[np.ndarray, "x y z"]
    """Mean log power over the pairs, at most zero."""
    low_m: Float64[np.ndarray, "3"]
    """Lower corner of the first cell [m]."""
    high_m: Float64[np.ndarray, "3"]
    """Upper corner that nothing is drawn beyond [m]."""

    @staticmethod
    def of(maps: PairMaps, bodies: Bodies, bounds_m: Float64[np.ndarray, "2 3"]) -> StartCells:
        """The cells that bodies may fill as they hold themselves."""
        reach_m = LYING_REACH_M if bodies.lies.any() else REACH_M
        return StartCells.around(maps, bodies.axes_xy, bounds_m, reach_m)

    @staticmethod
    def around(
        maps: PairMaps,
        axes_xy: Float[np.ndarray, "body 2"],
        bounds_m: Float64[np.ndarray, "2 3"],
        reach_m: float = REACH_M,
    ) -> StartCells:
        """The cells that bodies at `axes_xy` may fill, this far around them [m]."""
        floor_m = bounds_m[0, 2]
        low = np.maximum([*(axes_xy.min(axis=0) - reach_m), floor_m], bounds_m[0])
        high = np.minimum([*(axes_xy.max(axis=0) + reach_m), floor_m + REACH_HEIGHT_M], bounds_m[1])
        axes = [np.arange(low[k] + CELL_M / 2, high[k], CELL_M) for k in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        evidence = np.log(maps.at(points.reshape(-1, 3)) + 1e-3).mean(axis=0)
        evidence = (evidence - evidence.max()).reshape(points.shape[:3])
        return StartCells(points, evidence, low, high)

    def density(self, bodies: Bodies) -> StartDensity:
        """Where Gaussians of these bodies are drawn."""
        points, shape = self.points.reshape(-1, 3), self.points.shape[:3]
        prior = np.exp(surface_prior(points, bodies)[0]).reshape(shape)
        share = prior * np.exp(EVIDENCE_EXPONENT * self.evidence)
        whose = nearest_axis(points, bodies.axes_xy).reshape(shape)
        for body in range(len(bodies)):
            mine = whose == body
            own = np.where(mine, share, 0)
            wanted = _densest(np.where(mine, prior, 0))
            own *= (wanted / np.maximum(_densest(own), 1e-300)) ** (1 - HEIGHT_EVIDENCE)
            share = np.where(mine, own * wanted.sum() / max(_densest(own).sum(), 1e-300), share)
        return StartDensity(share / share.sum(), self.low_m, self.high_m)


def _densest(share: Float64[np.ndarray, "x y z"]) -> Float64[np.ndarray, "z"]:
    """Mean of the likeliest cells of each height, as many as a trunk's cross-section covers."""
    cells = share.reshape(-1, share.shape[2])
    count = min(round(CROSS_SECTION_M2 / CELL_M**2), len(cells))
    return np.partition(cells, len(cells) - count, axis=0)[len(cells) - count :].mean(axis=0)
