# SPDX-License-Identifier: Apache-2.0
"""Blind people: ellipsoids of a person's size, standing where the method says.

It knows nothing of limbs or pose. A method that does not beat it has found where the person
is, not what the person looks like. The template is a surface, as the reference is; filled, it is
shown as a baseline of its own.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from rfgs_core.evaluate.evidence import BaselineResult, Evidence

#: Semi-axes of the ellipsoid [m]; it stands on the floor, the lower bound of the scene.
SEMI_AXES_M = (0.25, 0.20, 0.85)

WHY_NO_CENTROID = "the method predicts nothing, so it has no centroid"
WHY_NO_CHANNEL = "a shape only; it predicts no channel"


def _places(evidence: Evidence) -> list[tuple[float, float]]:
    """Where on the ground bodies stand: one at the method's centroid, several where it has them.

    The centroid of several is between them, where nobody is.
    """
    assert evidence.method_centroid_m is not None
    bodies = evidence.method_bodies
    if bodies is not None and len(bodies.axes_xy) > 1:
        return [(float(x), float(y)) for x, y in bodies.axes_xy]
    x, y, _ = evidence.method_centroid_m
    return [(float(x), float(y))]


def _radius(
    evidence: Evidence, place: tuple[float, float]
) -> tuple[Float64[np.ndarray, "x y z"], Float64[np.ndarray, "x y z"]]:
    """Ellipsoidal radius of every voxel (1 on the surface) and its gradient's length [1/m]."""
    grid, axes = evidence.grid, SEMI_AXES_M
    centre = (*place, grid.origin_m[2] + axes[2])
    u, v, w = ((grid.axis_m(a) - centre[a]) / axes[a] for a in range(3))
    radius = np.sqrt(u[:, None, None] ** 2 + v[:, None] ** 2 + w**2)
    slope = np.sqrt(
        (u / axes[0])[:, None, None] ** 2 + (v / axes[1])[:, None] ** 2 + (w / axes[2]) ** 2
    )
    return radius, slope / np.maximum(radius, 1e-6)


def baseline(evidence: Evidence) -> BaselineResult:
    """The ellipsoids' surfaces."""
    if evidence.method_centroid_m is None:
        return BaselineResult(reason=WHY_NO_CENTROID)
    distance_m = np.full(evidence.grid.shape, np.inf)
    for place in _places(evidence):
        radius, slope = _radius(evidence, place)
        # Distance to the surface to first order: (radius − 1) over the gradient's length.
        off_m = np.abs(radius - 1.0) / np.maximum(slope, 1e-6)
        distance_m = np.minimum(distance_m, off_m)
    score = np.exp(-distance_m / evidence.grid.voxel_m).astype(np.float32)
    return BaselineResult(score=score, reason=WHY_NO_CHANNEL)


def filled(evidence: Evidence) -> BaselineResult:
    """The same ellipsoids filled from their axes outwards; K voxels do not reach their surface."""
    if evidence.method_centroid_m is None:
        return BaselineResult(reason=WHY_NO_CENTROID)
    nearest = np.min([_radius(evidence, place)[0] for place in _places(evidence)], axis=0)
    score = np.exp(-nearest).astype(np.float32)
    return BaselineResult(score=score, reason=WHY_NO_CHANNEL)
