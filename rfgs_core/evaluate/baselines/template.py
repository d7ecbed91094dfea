# SPDX-License-Identifier: Apache-2.0
"""A blind person: an ellipsoid of a person's size, standing where the method says.

It knows nothing of limbs or pose. A method that does not beat it has found where the person
is, not what the person looks like. The template is a surface, as the reference is; filled, it is
shown as a baseline of its own.
"""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.evidence import BaselineResult, Evidence

#: Semi-axes of the ellipsoid [m]; it stands on the floor, the lower bound of the scene.
SEMI_AXES_M = (0.25, 0.20, 0.85)

WHY_NO_CENTROID = "the method predicts nothing, so it has no centroid"
WHY_NO_CHANNEL = "a shape only; it predicts no channel"


def _radius(evidence: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Ellipsoidal radius of every voxel (1 on the surface) and its gradient's length [1/m]."""
    assert evidence.method_centroid_m is not None
    grid, axes = evidence.grid, SEMI_AXES_M
    x, y, _ = evidence.method_centroid_m
    centre = (float(x), float(y), grid.origin_m[2] + axes[2])
    u, v, w = ((grid.axis_m(a) - centre[a]) / axes[a] for a in range(3))
    radius = np.sqrt(u[:, None, None] ** 2 + v[:, None] ** 2 + w**2)
    slope = np.sqrt(
        (u / axes[0])[:, None, None] ** 2 + (v / axes[1])[:, None] ** 2 + (w / axes[2]) ** 2
    )
    return radius, slope / np.maximum(radius, 1e-6)


def baseline(evidence: Evidence) -> BaselineResult:
    """The ellipsoid's surface at the method's own centroid."""
    if evidence.method_centroid_m is None:
        return BaselineResult(reason=WHY_NO_CENTROID)
    radius, slope = _radius(evidence)
    # Distance to the surface to first order: (radius − 1) over the gradient's length.
    distance_m = np.abs(radius - 1.0) / np.maximum(slope, 1e-6)
    score = np.exp(-distance_m / evidence.grid.voxel_m).astype(np.float32)
    return BaselineResult(score=score, reason=WHY_NO_CHANNEL)


def filled(evidence: Evidence) -> BaselineResult:
    """The same ellipsoid filled from its axis outwards; K voxels do not reach its surface."""
    if evidence.method_centroid_m is None:
        return BaselineResult(reason=WHY_NO_CENTROID)
    score = np.exp(-_radius(evidence)[0]).astype(np.float32)
    return BaselineResult(score=score, reason=WHY_NO_CHANNEL)
