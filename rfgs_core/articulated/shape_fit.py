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
#: A mean of what is known to ±σ is shorter than the limb: of σ² of both its ends this share is
#: missing in the square of its length, and so much of the root of that sum is in doubt. Of 18
#: random people at mmWave the share is 0.27 to 0.89, the larger the surer joints are.
_MISSING, _DOUBT = 0.45, 0.2
#: Lengths between joints that bending does not change, by their lower joint.
_STIFF = (1, 2, 3, 4, 5, 6, 12, 13, 15, 16)
_STEPS = 4


def fit_shape(joints: np.ndarray, count: int = 3, sigma_m: np.ndarray | None = None) -> np.ndarray:
    """Coefficients of a body whose limbs are as long as those of joints over a sequence.

    Gauss-Newton on the mean lengths of thighs, shins, arms and between the hips, with a
    standard normal prior on the coefficients.

    Args:
        joints: Joints of one person [m], shape [T, 17, 3]; NaN where unknown.
        count: How many of the first components, those of height and lengths, to fit.
        sigma_m: How far each joint is expected to be off, if `joints` are means of what is not
            known better [m], shape [T, 17]; None for joints that are known.

    Returns:
        Coefficients [K], zero after the first `count`.

    Raises:
        RfgsError: The shape does not fit, or no limb is ever known.
    """
    if joints.ndim != 3 or joints.shape[1:] != (17, 3):
        raise RfgsError(f"joints over time: expected [T, 17, 3], got {list(joints.shape)}")
    space = people()
    rows, parents = np.array(_STIFF), np.array(PARENTS)[np.array(_STIFF)]
    lengths = np.linalg.norm(joints[:, rows] - joints[:, parents], axis=2)
    known = np.isfinite(lengths).any(axis=0)
    if not known.any():
        raise RfgsError("joints over time: no limb has both its ends in any frame")
    # The median: a few frames with a joint far off stretch no bone.
    wanted, doubt = np.nanmedian(lengths[:, known], axis=0), np.full(known.sum(), _LENGTH_M)
    if sigma_m is not None:
        square = (sigma_m[:, rows] ** 2 + sigma_m[:, parents] ** 2).mean(axis=0)[known]
        wanted = np.sqrt(wanted**2 + _MISSING * square)
        doubt = np.hypot(_LENGTH_M, _DOUBT * np.sqrt(square))
    out = np.zeros(len(space.components))
    step = 1e-3
    for _ in range(_STEPS):
        now = _lengths(space, out)[known]
        slope = np.zeros((len(wanted), count))
        for k in range(count):
            moved = out.copy()
            moved[k] += step
            slope[:, k] = (_lengths(space, moved)[known] - now) / step
        matrix = slope.T @ (slope / doubt[:, None] ** 2) + np.eye(count)
        right = slope.T @ ((wanted - now) / doubt**2) - out[:count]
        out[:count] += np.linalg.solve(matrix, right)
    return out


def _lengths(space: ShapeSpace, coefficients: np.ndarray) -> np.ndarray:
    """Lengths of the stiff limbs of a body [m], as `_STIFF`."""
    heads = space.heads(coefficients)
    body = Body(np.zeros((1, 3)), space.faces, heads, space.weights)
    joints = body.joints_of(heads, np.eye(3))
    rows = np.array(_STIFF)
    return np.linalg.norm(joints[rows] - joints[np.array(PARENTS)[rows]], axis=1)
