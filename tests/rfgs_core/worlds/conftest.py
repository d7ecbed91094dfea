# SPDX-License-Identifier: Apache-2.0
"""A person, and her or his joints over a motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rfgs_core.articulated import Body, people
from rfgs_core.worlds.motion import Motion


@pytest.fixture(scope="session")
def person() -> Body:
    """Somebody in clothes."""
    return people().random(np.random.default_rng(0))


@pytest.fixture(scope="session")
def joints_of() -> Callable[[Body, Motion, float], np.ndarray]:
    """Joints [T, 17, 3] of a motion, every so many seconds."""

    def follow(body: Body, motion: Motion, step_s: float) -> np.ndarray:
        times = np.arange(0.0, motion.duration_s, step_s)
        return np.stack([body.joints17(motion.at(float(time_s))) for time_s in times])

    return follow
