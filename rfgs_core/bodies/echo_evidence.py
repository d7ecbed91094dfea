# SPDX-License-Identifier: Apache-2.0
"""How likely a frame is with bodies in it, each with what the walls send back of them."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.expected_echoes import ExpectedEchoes, middle_of
from rfgs_core.limbs.evidence.entries import pairs_of
from rfgs_core.limbs.evidence.levels import Levels
from rfgs_core.measure.observations import Observations

#: Of each device pair the covariances of a body's straight echoes, and of those off one wall.
Parts: TypeAlias = list[
    tuple[Complex64[np.ndarray, "entry entry"], Complex64[np.ndarray, "entry entry"]]
]


class EchoEvidence:
    """The device pairs of a frame that hear anything, steered to a place."""

    def __init__(self, observations: Observations, near: Float64[np.ndarray, "2"]) -> None:
        self._bounds_m = observations.bounds_m
        self._floor_m = float(observations.bounds_m[0, 2])
        pairs = pairs_of(observations, middle_of(Bodies.standing(near[None]), self._floor_m))
        self.pairs = [pair for pair in pairs if pair.change.any()]

    def parts(self, one: Bodies, size: float = 0.0, rise_m: float = 0.0) -> Parts:
        """What each pair hears of a single body.

        Args:
            one: The body.
            size: How far it is from the mean adult in size [standard deviations].
            rise_m: How far above the ground it stands [m].
        """
        body = ExpectedEchoes.at(one, self._floor_m + rise_m, self.pairs, size)
        return [(body.echoes(pair), body.by_bounces(pair, self._bounds_m)) for pair in self.pairs]

    def log(self, bodies: list[Parts]) -> float:
        """Log-likelihood of some bodies at their likeliest levels, less a constant [nat]."""
        return sum(
            Levels.fitted(
                pair.change, [part for body in bodies for part in body[row]]
            ).log_likelihood
            for row, pair in enumerate(self.pairs)
        )
