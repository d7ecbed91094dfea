# SPDX-License-Identifier: Apache-2.0
"""Bodies, and random poses within human limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rfgs_core.articulated import Body, Pose, people
from rfgs_core.articulated.bones import PARENT_ROWS
from rfgs_core.articulated.limits import limits
from rfgs_core.articulated.turns import chained, turn_of


@pytest.fixture(scope="session")
def mean_body() -> Body:
    """The mean adult."""
    return people().body(np.zeros(12))


@pytest.fixture(scope="session")
def random_pose() -> Callable[[Body, np.random.Generator], Pose]:
    """A function that bends every joint at random."""

    def draw(body: Body, rng: np.random.Generator) -> Pose:
        prior = limits()
        vectors = rng.normal(size=prior.width.shape) * np.minimum(prior.width, 1.0) * 0.7
        vectors = np.clip(vectors, 0.9 * prior.low, 0.9 * prior.high)
        local = prior.middle @ np.stack([turn_of(vector) for vector in vectors])
        local[0] = turn_of(1.2 * rng.normal(size=3))
        return Pose(rng.normal(size=3), chained(PARENT_ROWS, local) @ body.neutral)

    return draw
