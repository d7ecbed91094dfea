# SPDX-License-Identifier: Apache-2.0
"""How far joints turn: a soft prior over rotations against the parent.

Rotations are measured from the anatomical position (`Body.neutral`) as vectors about the axes
x (ahead), y (left) and z (up): to the left side of the body a limb is lifted about +x, ahead
about -y and turned outwards about +z; knees bend about +y, elbows about -y, the trunk ahead
about +y. Ranges follow the normal ones of the American Academy of Orthopaedic Surgeons (1965),
rounded outwards; widths say how ordinary a rotation is, and are narrow where 17 joints say
nothing, such as about the length of a forearm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from rfgs_core.articulated.bones import BONES, MIRRORED
from rfgs_core.articulated.turns import turn_of

_INFINITE = 1e3


@dataclass(frozen=True)
class Limits:
    """Prior of every bone; vectors are those of the rotation from `middle`."""

    middle: np.ndarray
    """Most ordinary rotation against the parent, shape [B, 3, 3]."""
    width: np.ndarray
    """What is as likely as 1 cm off at a joint [rad], shape [B, 3]."""
    low: np.ndarray
    """Least vector [rad], shape [B, 3]."""
    high: np.ndarray
    """Largest vector [rad], shape [B, 3]."""


#: Middle, width, least and largest vector [rad] of bones in the middle and on the left.
_LEFT = {
    "pelvis": ((0, 0, 0), (_INFINITE,) * 3, (-_INFINITE,) * 3, (_INFINITE,) * 3),
    "spine_lower": ((0, 0, 0), (0.3, 0.4, 0.2), (-0.4, -0.4, -0.3), (0.4, 0.8, 0.3)),
    "spine_middle": ((0, 0, 0), (0.3, 0.4, 0.3), (-0.4, -0.4, -0.4), (0.4, 0.8, 0.4)),
    "spine_upper": ((0, 0, 0), (0.3, 0.4, 0.3), (-0.4, -0.4, -0.5), (0.4, 0.7, 0.5)),
    "neck": ((0, 0, 0), (0.4, 0.5, 0.3), (-0.5, -0.7, -0.7), (0.5, 0.6, 0.7)),
    "head": ((0, 0, 0), (0.4, 0.5, 0.2), (-0.5, -0.7, -0.8), (0.5, 0.6, 0.8)),
    "clavicle_left": ((0, 0, 0), (0.25, 0.1, 0.25), (-0.3, -0.2, -0.5), (0.7, 0.2, 0.4)),
    "upperarm_left": ((0.6, -0.9, 0.0), (1.5, 1.5, 0.8), (-2.0, -2.4, -1.6), (2.2, 2.4, 1.6)),
    "lowerarm_left": ((0, -0.7, 0), (0.08, 1.2, 0.1), (-0.1, -1.9, -1.5), (0.1, 0.72, 1.5)),
    "hand_left": ((0, 0, 0), (0.4, 0.4, 0.2), (-0.6, -1.2, -0.3), (0.6, 1.2, 0.3)),
    "upperleg_left": ((0.1, -0.6, 0), (0.6, 1.0, 0.4), (-0.7, -1.8, -0.8), (0.9, 1.2, 0.8)),
    "lowerleg_left": ((0, 0.5, 0), (0.08, 1.2, 0.1), (-0.1, -0.52, -0.3), (0.1, 2.1, 0.3)),
    "foot_left": ((0, 0, 0), (0.3, 0.4, 0.2), (-0.4, -0.5, -0.3), (0.4, 0.9, 0.3)),
}


@cache
def limits() -> Limits:
    """The prior of an adult, the right side as the mirror image of the left."""
    rows = [[np.array(part, np.float64) for part in _of(name)] for name in BONES]
    middle, width, low, high = (np.stack(part) for part in zip(*rows, strict=True))
    return Limits(np.stack([turn_of(vector) for vector in middle]), width, low, high)


def _of(name: str) -> tuple[np.ndarray, ...]:
    """Middle, width, least and largest vector of a bone."""
    if name in _LEFT:
        return tuple(np.array(part, np.float64) for part in _LEFT[name])
    middle, width, low, high = _of(BONES[MIRRORED[BONES.index(name)]])
    flip = np.array([-1.0, 1.0, -1.0])
    ends = np.stack([flip * low, flip * high])
    return flip * middle, width, ends.min(axis=0), ends.max(axis=0)
