# SPDX-License-Identifier: Apache-2.0
"""The shape of a person from the lengths of bones."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated.body import Body
from rfgs_core.articulated.space import ShapeSpace, people
from rfgs_core.errors import RfgsError
from rfgs_core.skeleton import PARENTS

#: Length that is as uncertain as one standard deviation between people [m].
_LENGTH_M = 0.01
#: Lengths between joints that bending does not change, by their lower joint.
_STIFF = (1, 2, 3, 4, 5, 6, 12, 13, 15, 16)
_STEPS = 4


def fit_shape(joints: np.ndarray, count: int = 3) -> np.ndarray:
    """Coefficients of a body whose limbs are as long as those of joints over a sequence.

    Gauss-Newton on the mean lengths of thighs, shins, arms and between the hips, with a
    standard normal prior on the coefficients.

    Args:
        joints: Joints of one person [m], shape [T, 17, 3]; NaN where unknown.
        count: How many of the first components, those of height and lengths, to fit.

    Returns:
        Coefficients [K], zero after the first `count`.

    Raises:
        RfgsError: The shape does not fit, or no limb is ever known.
    """
    if joints.ndim != 3 or joints.shape[1:] != (17, 3):
        raise RfgsError(f"joints over time: expected [T, 17, 3], got {list(joints.shape)}")
    space = people()
    rows = np.array(_STIFF)
    lengths = np.linalg.norm(joints[:, rows] - joints[:, np.array(PARENTS)[rows]], axis=2)
    known = np.isfinite(lengths).any(axis=0)
    if not known.any():
        raise RfgsError("joints over time: no limb has both its ends in any frame")
    # The median: a few frames with a joint far off stretch no bone.
    wanted = np.nanmedian(lengths[:, known], axis=0)
    out = np.zeros(len(space.components))
    step = 1e-3
    for _ in range(_STEPS):
        now = _lengths(space, out)[known]
        slope = np.zeros((len(wanted), count))
        for k in range(count):
            moved = out.copy()
            moved[k] += step
            slope[:, k] = (_lengths(space, moved)[known] - now) / step
        matrix = slope.T @ slope / _LENGTH_M**2 + np.eye(count)
        right = slope.T @ (wanted - now) / _LENGTH_M**2 - out[:count]
        out[:count] += np.linalg.solve(matrix, right)
    return out


def _lengths(space: ShapeSpace, coefficients: np.ndarray) -> np.ndarray:
    """Lengths of the stiff limbs of a body [m], as `_STIFF`."""
    heads = space.heads(coefficients)
    body = Body(np.zeros((1, 3)), space.faces, heads, space.weights)
    joints = body.joints_of(heads, np.eye(3))
    rows = np.array(_STIFF)
    return np.linalg.norm(joints[rows] - joints[np.array(PARENTS)[rows]], axis=1)
