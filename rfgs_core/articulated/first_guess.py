# SPDX-License-Identifier: Apache-2.0
"""Where a fit of a pose begins: every limb points where its joints say."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated.body import Body, frame_of
from rfgs_core.articulated.bones import BONES, PARENT_ROWS, bone
from rfgs_core.articulated.limits import limits
from rfgs_core.articulated.turns import chained, turn_of
from rfgs_core.skeleton import JOINTS

_DOWN, _RIGHT = np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0])
_LIMB_FRAME = frame_of(_DOWN, _RIGHT)
#: Limbs bent less than this do not tell where their hinge is [rad].
_STRAIGHT_RAD = 0.15
_LIMBS = (
    ("upperarm", "lowerarm", ("shoulder", "elbow", "wrist"), 1.0),
    ("upperleg", "lowerleg", ("hip", "knee", "ankle"), -1.0),
)


def first_guess(
    body: Body, joints17: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Root [3] and rotations against the parents from neutral [B, 3, 3].

    Args:
        body: Whose pose.
        joints17: Joints [m], shape [17, 3].
        counts: 0 of the joints that are not known, shape [17].
    """
    place: dict[str, np.ndarray] = dict(zip(JOINTS, joints17, strict=True))
    known = {name for name, count in zip(JOINTS, counts, strict=True) if count > 0.0}
    local = limits().middle.copy()
    local[0] = _heading(place, known)
    for side in ("left", "right"):
        for first, second, ends, sign in _LIMBS:
            names = [f"{side}_{end}" for end in ends]
            if known.issuperset(names):
                rows = bone(f"{first}_{side}"), bone(f"{second}_{side}")
                world = chained(PARENT_ROWS, local)
                points = np.stack([place[name] for name in names]) @ world[PARENT_ROWS[rows[0]]]
                local[rows[0]], local[rows[1]] = _limb(points, sign)
    centre = joints17[counts > 0.0].mean(axis=0)
    world = chained(PARENT_ROWS, local) @ body.neutral
    own = body.heads.copy()
    for row in range(1, len(BONES)):
        up = PARENT_ROWS[row]
        own[row] = own[up] + world[up] @ (body.heads[row] - body.heads[up])
    joints = body.joints_of(own, world[bone("head")])
    return own[0] + centre - joints[counts > 0.0].mean(axis=0), local


def _heading(place: dict[str, np.ndarray], known: set[str]) -> np.ndarray:
    """Rotation [3, 3] of the pelvis: its left is between the hips, its up along the spine."""
    for left, right in (("left_hip", "right_hip"), ("left_shoulder", "right_shoulder")):
        for high, low in (("thorax", "pelvis"), ("neck", "pelvis"), ("head", "spine")):
            if known.issuperset((left, right, high, low)):
                y, z = place[left] - place[right], place[high] - place[low]
                if np.linalg.norm(np.cross(y, z)) > 1e-6:
                    # Columns of `frame_of`: up, left, and their product, which looks back.
                    up, side, back = frame_of(z, y).T
                    return np.stack([-back, side, up], axis=1)
    return np.eye(3)


def _limb(points: np.ndarray, sign: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotations of both bones of a limb; `sign` is 1 where it bends ahead, -1 back.

    Args:
        points: Ends of the bones in the parent's axes [m], shape [3, 3].
        sign: 1 of arms, -1 of legs.
    """
    upper, lower = (part / max(np.linalg.norm(part), 1e-9) for part in np.diff(points, axis=0))
    hinge = sign * np.cross(upper, lower)
    angle = np.arctan2(np.linalg.norm(hinge), upper @ lower)
    if angle < _STRAIGHT_RAD:
        axis = np.cross(_DOWN, upper)
        size = float(np.linalg.norm(axis))
        straight = turn_of(axis * (np.arctan2(size, _DOWN @ upper) / max(size, 1e-9)))
        hinge = straight @ _RIGHT
    turn = frame_of(upper, hinge) @ _LIMB_FRAME.T
    return turn, turn_of(np.array([0.0, -sign * angle, 0.0]))
