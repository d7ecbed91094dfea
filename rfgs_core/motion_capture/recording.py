# SPDX-License-Identifier: Apache-2.0
"""A recorded skeleton and its motion, whatever file it came from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

_UP = {"y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}


@dataclass(frozen=True)
class Recording:
    """A recorded skeleton and its motion, in the axes and units of the file."""

    joints: tuple[str, ...]
    """Names, parents before children."""
    parents: tuple[int, ...]
    """Index of each joint's parent, -1 for the root."""
    offsets: np.ndarray
    """From the parent to each joint at rest, shape (J, 3)."""
    turns: np.ndarray
    """Rotation of each joint against its parent, shape (F, J, 3, 3)."""
    root: np.ndarray
    """Position of the root, shape (F, 3)."""
    frame_s: float
    """Time from frame to frame [s]."""

    def world_turns(self) -> np.ndarray:
        """Rotation of each joint against its rest, in the axes of the file, (F, J, 3, 3)."""
        out = self.turns.copy()
        for index, parent in enumerate(self.parents):
            if parent >= 0:
                out[:, index] = out[:, parent] @ self.turns[:, index]
        return out

    def places(self) -> np.ndarray:
        """Where every joint is, in the axes and units of the file, (F, J, 3)."""
        world = self.world_turns()
        out = np.zeros(world.shape[:3])
        for index, parent in enumerate(self.parents):
            if parent >= 0:
                out[:, index] = out[:, parent] + world[:, parent] @ self.offsets[index]
            else:
                out[:, index] = self.root
        return out

    def repeated(self, times: int, up: str = "y") -> Recording:
        """The recording several times over, each from where the one before ended.

        For cycles, whose last pose is their first, somewhere else: that frame counts once.

        Args:
            times: How many times, at least once.
            up: Axis that is up in the file, `y` or `z`; the ground is level.
        """
        axis = _UP[up]
        turn = self.turns[-1, 0] @ self.turns[0, 0].T
        # What the whole turn has of one about the vertical.
        *xyz, w = Rotation.from_matrix(turn).as_quat()
        ahead = Rotation.from_rotvec(2.0 * np.arctan2(axis @ xyz, w) * axis).as_matrix()
        level = np.eye(3) - np.outer(axis, axis)
        turns, root = [self.turns], [self.root]
        for _ in range(times - 1):
            shift = level @ (root[-1][-1] - ahead @ root[-1][0])
            again = turns[-1].copy()
            again[:, 0] = ahead @ again[:, 0]
            root.append(root[-1] @ ahead.T + shift)
            turns.append(again)
        rest = [part[1:] for part in turns[1:]], [part[1:] for part in root[1:]]
        return replace(
            self,
            turns=np.concatenate([turns[0], *rest[0]]),
            root=np.concatenate([root[0], *rest[1]]),
        )
