# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: the pose whose 17 joints are nearest to given ones."""

from __future__ import annotations

import numpy as np
from numba import njit

from rfgs_core.articulated.body import Body
from rfgs_core.articulated.bones import BONE_OF_JOINT, PARENT_ROWS, SKULL_M, bone
from rfgs_core.articulated.first_guess import first_guess
from rfgs_core.articulated.limits import limits
from rfgs_core.articulated.pose import Pose
from rfgs_core.articulated.turns import OPTIONS, chained, multiplied, turn_of, vector_of
from rfgs_core.errors import RfgsError

#: Distance from a given joint that costs as much as one width of the prior [m].
_JOINT_M = 0.005
#: Turning this far over a limit costs as much [rad].
_BEYOND_RAD = 0.05
_MOST_STEPS = 25
#: A step that moves nothing farther than this is the last [m or rad].
_STILL = 1e-4
_HEAD = bone("head")


def fit_pose(
    body: Body, joints17: np.ndarray, weight: np.ndarray, start: Pose | None = None
) -> Pose:
    """The pose of a body whose joints are nearest to the given ones, within human limits.

    Damped Gauss-Newton over the root and a rotation vector of every bone against its parent:

        Σ_j weight_j |p_j - joints17_j|² / σ² + Σ_b |vector_b / width_b|² + beyond limits

    What joints do not tell, the twist of a stretched limb or where hands and feet point, stays
    as in the anatomical position.

    Args:
        body: Whose pose; the lengths of its bones are kept.
        joints17: Joints in the order of `rfgs_core.skeleton.JOINTS` [m], shape [17, 3].
        weight: How much each joint counts, (5 mm / its standard deviation)²; 1 follows the
            joints to millimetres, 0 leaves out those not known; shape [17].
        start: Where to begin, such as the pose of the frame before; by default from the joints.

    Raises:
        RfgsError: Shapes do not fit, no joint counts, or one that does is not finite.
    """
    target, counts = _checked(joints17, weight)
    if start is None:
        root, local = first_guess(body, target, counts)
    else:
        world = start.turns @ np.swapaxes(body.neutral, 1, 2)
        root, local = start.root.copy(), world.copy()
        local[1:] = np.swapaxes(world[PARENT_ROWS[1:]], 1, 2) @ world[1:]
    prior = limits()
    steps = body.heads - body.heads[PARENT_ROWS]
    root, local = _fitted(
        PARENT_ROWS, steps, body.neutral, prior.middle, 1.0 / prior.width, prior.low, prior.high,
        target, np.sqrt(counts) / _JOINT_M, root, np.ascontiguousarray(local),
    )  # fmt: skip
    return Pose(root, chained(PARENT_ROWS, local) @ body.neutral)


def _checked(joints17: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    target, counts = np.array(joints17, np.float64), np.array(weight, np.float64)
    if target.shape != (17, 3) or counts.shape != (17,):
        raise RfgsError(
            f"joints of a pose: expected shapes [17, 3] and [17], got {list(target.shape)} "
            f"and {list(counts.shape)}"
        )
    used = counts > 0.0
    if not used.any() or not np.isfinite(counts).all() or not np.isfinite(target[used]).all():
        raise RfgsError("joints of a pose: expected finite joints, at least one of weight over 0")
    target[~used] = 0.0
    return target, np.where(used, counts, 0.0)


@njit(**OPTIONS)
def _placed(
    parents: np.ndarray,
    steps: np.ndarray,
    neutral: np.ndarray,
    root: np.ndarray,
    local: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotations from neutral [B, 3, 3], heads of the bones [B, 3], the middle of the skull [3]."""
    world = chained(parents, local)
    heads = np.zeros((len(parents), 3))
    heads[0] = root
    for b in range(1, len(parents)):
        up = parents[b]
        turn = multiplied(world[up], neutral[up])
        for axis in range(3):
            heads[b, axis] = heads[up, axis]
            for k in range(3):
                heads[b, axis] += turn[axis, k] * steps[b, k]
    return world, heads, heads[_HEAD] + SKULL_M * world[_HEAD, :, 2]


@njit(**OPTIONS)
def _joint(j: int, heads: np.ndarray, skull: np.ndarray) -> np.ndarray:
    """Place [3] of one of the 17 joints."""
    if j == 0:
        return 0.5 * (heads[BONE_OF_JOINT[1]] + heads[BONE_OF_JOINT[4]])
    if j == 10:
        return skull
    return heads[BONE_OF_JOINT[j]]


@njit(**OPTIONS)
def _cost(
    local: np.ndarray, heads: np.ndarray, skull: np.ndarray, middle: np.ndarray,
    stiff: np.ndarray, low: np.ndarray, high: np.ndarray, target: np.ndarray, pull: np.ndarray,
) -> float:  # fmt: skip
    """What the fit makes small."""
    total = 0.0
    for j in range(17):
        if pull[j] > 0.0:
            total += pull[j] ** 2 * np.sum((_joint(j, heads, skull) - target[j]) ** 2)
    for b in range(1, len(local)):
        vector = vector_of(multiplied(middle[b].T, local[b]))
        for axis in range(3):
            over = vector[axis] - min(max(vector[axis], low[b, axis]), high[b, axis])
            total += (vector[axis] * stiff[b, axis]) ** 2 + (over / _BEYOND_RAD) ** 2
    return total


@njit(**OPTIONS)
def _add_joint(
    j: int, share: float, end: int, place: np.ndarray, parents: np.ndarray, world: np.ndarray,
    heads: np.ndarray, rows: np.ndarray,
) -> None:  # fmt: skip
    """Adds the derivative of a joint's place, times `share`, to rows [3, 3 + 3 B]."""
    for axis in range(3):
        rows[axis, axis] += share
    b = end
    while b >= 0:
        arm = place - heads[b]
        for k in range(3):
            x, y, z = world[b, 0, k], world[b, 1, k], world[b, 2, k]
            column = 3 + 3 * b + k
            rows[0, column] += share * (y * arm[2] - z * arm[1])
            rows[1, column] += share * (z * arm[0] - x * arm[2])
            rows[2, column] += share * (x * arm[1] - y * arm[0])
        b = parents[b]


@njit(**OPTIONS)
def _equations(
    parents: np.ndarray, world: np.ndarray, local: np.ndarray, heads: np.ndarray,
    skull: np.ndarray, middle: np.ndarray, stiff: np.ndarray, low: np.ndarray, high: np.ndarray,
    target: np.ndarray, pull: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Normal matrix [P, P] and right side [P] of the step, P = 3 + 3 B."""
    size = 3 + 3 * len(parents)
    jacobian, rest = np.zeros((51, size)), np.zeros(51)
    for j in range(17):
        if pull[j] == 0.0:
            continue
        rows = np.zeros((3, size))
        place = _joint(j, heads, skull)
        if j == 0:
            for hip in (1, 4):
                row = BONE_OF_JOINT[hip]
                _add_joint(j, 0.5, parents[row], heads[row], parents, world, heads, rows)
        else:
            end = _HEAD if j == 10 else parents[BONE_OF_JOINT[j]]
            _add_joint(j, 1.0, end, place, parents, world, heads, rows)
        jacobian[3 * j : 3 * j + 3] = pull[j] * rows
        rest[3 * j : 3 * j + 3] = pull[j] * (target[j] - place)
    matrix, right = jacobian.T @ jacobian, jacobian.T @ rest
    for b in range(1, len(parents)):
        # A vector grows by about the turn added to it: exact for small ones.
        vector = vector_of(multiplied(middle[b].T, local[b]))
        for axis in range(3):
            at = 3 + 3 * b + axis
            over = vector[axis] - min(max(vector[axis], low[b, axis]), high[b, axis])
            matrix[at, at] += stiff[b, axis] ** 2
            right[at] -= stiff[b, axis] ** 2 * vector[axis]
            if over != 0.0:
                matrix[at, at] += 1.0 / _BEYOND_RAD**2
                right[at] -= over / _BEYOND_RAD**2
    return matrix, right


@njit(**OPTIONS)
def _fitted(
    parents: np.ndarray, steps: np.ndarray, neutral: np.ndarray, middle: np.ndarray,
    stiff: np.ndarray, low: np.ndarray, high: np.ndarray, target: np.ndarray, pull: np.ndarray,
    root: np.ndarray, local: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Root [3] and rotations against the parents from neutral [B, 3, 3] after the fit."""
    world, heads, skull = _placed(parents, steps, neutral, root, local)
    cost = _cost(local, heads, skull, middle, stiff, low, high, target, pull)
    damping = 1e-3
    for _ in range(_MOST_STEPS):
        matrix, right = _equations(
            parents, world, local, heads, skull, middle, stiff, low, high, target, pull
        )
        better = False
        largest = 0.0
        for _try in range(6):
            damped = matrix.copy()
            for at in range(len(right)):
                damped[at, at] += damping * matrix[at, at] + 1e-6
            step = np.linalg.solve(damped, right)
            new = local.copy()
            for b in range(len(parents)):
                new[b] = multiplied(local[b], turn_of(step[3 + 3 * b : 6 + 3 * b]))
            moved = root + step[:3]
            world, heads, skull = _placed(parents, steps, neutral, moved, new)
            tried = _cost(new, heads, skull, middle, stiff, low, high, target, pull)
            if tried <= cost:
                better = True
                largest = np.abs(step).max()
                root, local = moved, new
                damping *= 0.2
                break
            damping = max(10.0 * damping, 1e-6)
        if not better:
            break
        gained, cost = cost - tried, tried
        if largest < _STILL or gained < 1e-5 * cost:
            break
    return root, local
