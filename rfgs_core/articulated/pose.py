# SPDX-License-Identifier: Apache-2.0
"""Poses: where the pelvis is and how every bone is turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rfgs_core.articulated.bones import BONES, MIRRORED, PARENT_ROWS
from rfgs_core.articulated.turns import chained
from rfgs_core.errors import RfgsError

_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Pose:
    """How a body stands in the world; at rest it looks along x, its left is y, z is up."""

    root: np.ndarray
    """Where the head of the pelvis's bone is [m], shape [3]."""
    turns: np.ndarray
    """Rotation of each bone against the world, from rest, shape [B, 3, 3]."""

    def __post_init__(self) -> None:
        if np.shape(self.root) != (3,) or np.shape(self.turns) != (len(BONES), 3, 3):
            raise RfgsError(
                f"pose: expected a root [3] and turns [{len(BONES)}, 3, 3], "
                f"got {list(np.shape(self.root))} and {list(np.shape(self.turns))}"
            )

    @classmethod
    def from_local(cls, root: np.ndarray, local: np.ndarray) -> Pose:
        """A pose from rotations against the parent bone.

        Args:
            root: Where the head of the pelvis's bone is [m], shape [3].
            local: Rotation of each bone against its parent, the pelvis's against the world,
                shape [B, 3, 3]; identities are the rest pose.
        """
        return cls(
            np.array(root, np.float64),
            chained(PARENT_ROWS, np.ascontiguousarray(local, np.float64)),
        )

    def local(self) -> np.ndarray:
        """Rotations against the parents [B, 3, 3]: what `from_local` takes."""
        out = self.turns.copy()
        out[1:] = np.swapaxes(self.turns[PARENT_ROWS[1:]], 1, 2) @ self.turns[1:]
        return out

    def moved(self, shift: np.ndarray) -> Pose:
        """The pose shifted by `shift` [3] in metres."""
        return Pose(self.root + shift, self.turns)

    def turned(self, turn: np.ndarray, about: np.ndarray | None = None) -> Pose:
        """The pose turned as a whole by `turn` [3, 3] about a point [3], by default the origin."""
        centre = np.zeros(3) if about is None else np.asarray(about, np.float64)
        return Pose(turn @ (self.root - centre) + centre, turn @ self.turns)

    def mirrored(self) -> Pose:
        """The pose seen in a mirror at y = 0: left does what right did."""
        turns = self.turns[list(MIRRORED)] * (_MIRROR[:, None] * _MIRROR[None, :])
        return Pose(self.root * _MIRROR, turns)
