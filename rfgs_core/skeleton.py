# SPDX-License-Identifier: Apache-2.0
"""The 17-joint human skeleton that labels, add-on and pose fits share."""

from __future__ import annotations

#: Joint names in the order of every `joints[person, joint, xyz]` array (Human3.6M order).
JOINTS = (
    "pelvis", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle",
    "spine", "thorax", "neck", "head", "left_shoulder", "left_elbow", "left_wrist",
    "right_shoulder", "right_elbow", "right_wrist",
)  # fmt: skip

#: Parent joint of each joint; the pelvis is the root.
PARENTS = (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 9, 8, 11, 12, 8, 14, 15)
