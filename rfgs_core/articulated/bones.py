# SPDX-License-Identifier: Apache-2.0
"""The bones of an articulated body, and where the 17 joints are on them."""

from __future__ import annotations

import numpy as np

#: Bones, parents before children.
BONES = (
    "pelvis", "spine_lower", "spine_middle", "spine_upper", "neck", "head", "clavicle_left",
    "upperarm_left", "lowerarm_left", "hand_left", "clavicle_right", "upperarm_right",
    "lowerarm_right", "hand_right", "upperleg_left", "lowerleg_left", "foot_left", "upperleg_right",
    "lowerleg_right", "foot_right",
)  # fmt: skip

#: Parent of each bone; the pelvis is the root.
PARENTS = (-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 3, 10, 11, 12, 0, 14, 15, 0, 17, 18)

#: The same as an array, for kernels.
PARENT_ROWS = np.array(PARENTS, np.int64)

#: The bone on the other side of the body, each bone itself where it is in the middle.
MIRRORED = tuple(
    BONES.index(name.replace("left", "#").replace("right", "left").replace("#", "right"))
    for name in BONES
)

#: Height of the middle of the skull over the head of the bone `head`, at rest [m].
SKULL_M = 0.075

#: Bone at whose head each of the 17 joints is (`rfgs_core.skeleton.JOINTS`); the pelvis is
#: between the hips and the head `SKULL_M` above its bone's head.
BONE_OF_JOINT = np.array(
    [
        BONES.index(name)
        for name in (
            "pelvis",
            "upperleg_right",
            "lowerleg_right",
            "foot_right",
            "upperleg_left",
            "lowerleg_left",
            "foot_left",
            "spine_middle",
            "neck",
            "head",
            "head",
            "upperarm_left",
            "lowerarm_left",
            "hand_left",
            "upperarm_right",
            "lowerarm_right",
            "hand_right",
        )
    ],
    np.int64,
)


def bone(name: str) -> int:
    """Row of a bone."""
    return BONES.index(name)
