# SPDX-License-Identifier: Apache-2.0
"""Reads clips in the format of DeepMimic (Peng et al., ACM Transactions on Graphics 37(4), 2018).

Its clips were recorded from people. `pip install pybullet` brings some as
`pybullet_data/data/motions/humanoid3d_*.txt`; rows hold a duration, the place of the root and a
rotation of every joint, of knees and elbows one angle.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from rfgs_core.errors import RfgsFormatError
from rfgs_core.motion_capture.recording import Recording
from rfgs_core.records import read_record

#: Joints in the order of the rows, parents, and offsets from the parents [m]: x is ahead, y up.
_JOINTS = (
    ("hips", -1, (0.0, 0.0, 0.0)), ("chest", 0, (0.0, 0.236151, 0.0)),
    ("neck", 1, (0.0, 0.223894, 0.0)), ("thigh.R", 0, (0.0, 0.0, 0.084887)),
    ("shin.R", 3, (0.0, -0.421546, 0.0)), ("foot.R", 4, (0.0, -0.409870, 0.0)),
    ("upperarm.R", 1, (-0.024050, 0.243496, 0.183110)),
    ("forearm.R", 6, (0.0, -0.274788, 0.0)), ("hand.R", 7, (0.0, -0.258947, 0.0)),
    ("thigh.L", 0, (0.0, 0.0, -0.084887)), ("shin.L", 9, (0.0, -0.421546, 0.0)),
    ("foot.L", 10, (0.0, -0.409870, 0.0)),
    ("upperarm.L", 1, (-0.024050, 0.243496, -0.183110)),
    ("forearm.L", 12, (0.0, -0.274788, 0.0)), ("hand.L", 13, (0.0, -0.258947, 0.0)),
)  # fmt: skip
#: Joints that only bend: one angle about z.
_HINGES = ("shin.R", "shin.L", "forearm.R", "forearm.L")
#: Joints that never turn.
_FIXED = ("hand.R", "hand.L")
#: Numbers of each joint in a row, behind a duration and the root's place.
_WIDTHS = tuple(1 if name in _HINGES else 0 if name in _FIXED else 4 for name, _, _ in _JOINTS)
_COLUMNS = 4 + sum(_WIDTHS)
#: How far from one a quaternion's length may be: editing leaves some uneven.
_UNEVEN = 0.5
#: From its axes to those of BVH: people look along z.
_TURN = Rotation.from_euler("y", -90.0, degrees=True).as_matrix()


class _Clip(msgspec.Struct):
    """The file; what else is in it does not matter."""

    Frames: list[list[float]]


def read_clip(path: Path) -> Recording:
    """Reads a clip.

    Raises:
        RfgsFormatError: The file is no clip of a person, or is damaged.
    """
    frames = read_record(path, _Clip, "expected a clip as DeepMimic has them").Frames
    lengths = {len(row) for row in frames}
    if lengths != {_COLUMNS}:
        raise RfgsFormatError(
            f"{path}: expected frames of {_COLUMNS} numbers, those of a person, found "
            f"{', '.join(str(length) for length in sorted(lengths)[:4]) or 'none'}"
        )
    rows = np.array(frames)
    step_s = rows[:-1, 0] if len(rows) > 1 else rows[:, 0]
    if not (step_s > 0.0).all() or np.ptp(step_s) > 0.01 * step_s.mean():
        raise RfgsFormatError(f"{path}: expected frames of one duration above zero")
    ends = 4 + np.cumsum(_WIDTHS)
    turns = np.broadcast_to(np.eye(3), (len(rows), len(_JOINTS), 3, 3)).copy()
    for joint, (end, width) in enumerate(zip(ends, _WIDTHS, strict=True)):
        values = rows[:, end - width : end]
        if width == 1:
            turns[:, joint] = Rotation.from_rotvec(values * [0.0, 0.0, 1.0]).as_matrix()
        elif width == 4:
            turns[:, joint] = _turns(path, _JOINTS[joint][0], values)
    return Recording(
        joints=tuple(name for name, _, _ in _JOINTS),
        parents=tuple(parent for _, parent, _ in _JOINTS),
        offsets=np.array([offset for _, _, offset in _JOINTS]) @ _TURN.T,
        turns=_TURN @ turns @ _TURN.T,
        root=rows[:, 1:4] @ _TURN.T,
        frame_s=float(step_s.mean()),
    )


def _turns(path: Path, joint: str, quats: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(quats, axis=1, keepdims=True)
    if np.abs(length - 1.0).max() > _UNEVEN:
        raise RfgsFormatError(f"{path}: rotations of {joint} are no unit quaternions")
    return Rotation.from_quat(np.roll(quats, -1, axis=1)).as_matrix()
