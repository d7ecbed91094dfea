# SPDX-License-Identifier: Apache-2.0
"""Who counts as low: by the length of their own legs."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.articulated import Pose, people
from rfgs_core.pose.estimate import is_low
from rfgs_core.worlds.motion import random_motion


@pytest.mark.parametrize("child", [False, True])
def test_children_who_stand_are_not_low_and_adults_on_chairs_are(child: bool) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        body = people().random(rng, child=child)
        upright = body.joints17(Pose(body.heads[0], body.neutral))
        assert not is_low(upright, 0.0)
        # The floor counts: on a step of 0.3 m the same person still stands.
        assert not is_low(upright + np.array([0.0, 0.0, 0.3]), 0.3)
        for family, low in (("walk", False), ("sit", True), ("lie", True)):
            motion = random_motion(rng, body, family)
            times = np.linspace(0.0, motion.duration_s, 12)
            moments = [body.joints17(motion.at(float(t))) for t in times]
            lowest = min(moments, key=lambda joints: joints[0, 2])
            # Beds carry who lies; the floor is what the person was on.
            floor_m = float(motion.floor_m.max()) if family == "lie" else 0.0
            assert is_low(lowest, floor_m) is low, (family, seed)
