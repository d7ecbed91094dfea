# SPDX-License-Identifier: Apache-2.0
"""What the start of a fit assumes of bodies, where the method has them, and nothing else.

The places and postures come from the radio; within a body this baseline knows nothing. What the
method has above it is what Gaussians say of a body's shape.
"""

from __future__ import annotations

import numpy as np

from rfgs_core.bodies.body_prior import surface_prior
from rfgs_core.evaluate.baselines.template import WHY_NO_CHANNEL
from rfgs_core.evaluate.evidence import BaselineResult, Evidence

WHY_NO_BODIES = "the method does not tell where its bodies stand or sit"


def baseline(evidence: Evidence) -> BaselineResult:
    """The prior's density at the method's own bodies, likeliest voxels first."""
    if evidence.method_bodies is None:
        return BaselineResult(reason=WHY_NO_BODIES)
    points = evidence.grid.centres(np.arange(evidence.grid.size))
    density = np.exp(surface_prior(points, evidence.method_bodies)[0])
    score = density.astype(np.float32).reshape(evidence.grid.shape)
    return BaselineResult(score=score, reason=WHY_NO_CHANNEL)
