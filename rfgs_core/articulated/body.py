# SPDX-License-Identifier: Apache-2.0
"""A person's body: skin and bones at rest, and where they are in a pose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rfgs_core.articulated.bones import BONE_OF_JOINT, PARENT_ROWS, SKULL_M, bone
from rfgs_core.articulated.pose import Pose
from rfgs_core.articulated.surface import skinned

_HEAD = bone("head")
_DOWN, _RIGHT = np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True)
class Body:
    """A body that at rest stands on z = 0, looks along x and has its left side at +y."""

    vertices: np.ndarray
    """Skin at rest, clothes included [m], shape [V, 3]."""
    faces: np.ndarray
    """Triangles, against the clock seen from outside, int32, shape [F, 3]."""
    heads: np.ndarray
    """Where each bone begins at rest [m], shape [B, 3]."""
    weights: tuple[np.ndarray, np.ndarray]
    """Index [V, 4] and weight [V, 4] of the bones that hold each vertex."""

    @property
    def height_m(self) -> float:
        """From the soles to the crown at rest, hair included [m]."""
        return float(np.ptp(self.vertices[:, 2]))

    @cached_property
    def rest(self) -> Pose:
        """The pose in which the body is stored: legs a little apart, arms down and aside."""
        return Pose(self.heads[0].copy(), np.tile(np.eye(3), (len(self.heads), 1, 1)))

    @cached_property
    def neutral(self) -> np.ndarray:
        """Rotation [B, 3, 3] from rest of each bone in the anatomical position.

        There the limbs hang straight down, elbows bend about the body's left-right axis and
        everything else is as at rest: joint angles of biomechanics are measured from it.
        """
        out = np.tile(np.eye(3), (len(self.heads), 1, 1))
        for side in ("left", "right"):
            upper, lower, end = (bone(f"{n}_{side}") for n in ("upperarm", "lowerarm", "hand"))
            above = self.heads[lower] - self.heads[upper]
            below = self.heads[end] - self.heads[lower]
            hinge = np.cross(above, below)
            out[upper] = frame_of(_DOWN, _RIGHT) @ frame_of(above, hinge).T
            out[lower] = frame_of(_DOWN, _RIGHT) @ frame_of(below, hinge).T
            out[end] = out[lower]
            hip, knee, ankle = (bone(f"{n}_{side}") for n in ("upperleg", "lowerleg", "foot"))
            for first, second in ((hip, knee), (knee, ankle)):
                along = self.heads[second] - self.heads[first]
                out[first] = frame_of(_DOWN, _RIGHT) @ frame_of(along, _RIGHT).T
        return out

    def heads_at(self, pose: Pose) -> np.ndarray:
        """Where each bone begins in a pose [m], shape [B, 3]."""
        out = np.zeros_like(self.heads)
        out[0] = pose.root
        steps = np.einsum("bij,bj->bi", pose.turns[PARENT_ROWS[1:]], self._steps[1:])
        for row, parent in enumerate(PARENT_ROWS[1:].tolist(), start=1):
            out[row] = out[parent] + steps[row - 1]
        return out

    def joints17(self, pose: Pose) -> np.ndarray:
        """The joints of labels in a pose [m], shape [17, 3], as `rfgs_core.skeleton.JOINTS`."""
        return self.joints_of(self.heads_at(pose), pose.turns[_HEAD])

    def joints_of(self, heads: np.ndarray, head_turn: np.ndarray) -> np.ndarray:
        """The 17 joints [17, 3] from bone heads [B, 3] and the rotation [3, 3] of the skull."""
        out = heads[BONE_OF_JOINT]
        out[0] = 0.5 * (out[1] + out[4])
        out[10] = heads[_HEAD] + SKULL_M * head_turn[:, 2]
        return out

    def skin(self, pose: Pose) -> np.ndarray:
        """Vertices in a pose [m], shape [V, 3]."""
        return skinned(self.vertices, *self.weights, *self.from_rest(pose))

    def from_rest(self, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Rotation [B, 3, 3] and translation [B, 3] in metres of each bone from rest to a pose."""
        turns = np.ascontiguousarray(pose.turns, np.float64)
        return turns, self.heads_at(pose) - np.einsum("bij,bj->bi", turns, self.heads)

    @cached_property
    def _steps(self) -> np.ndarray:
        """From the head of the parent to that of each bone at rest [m], shape [B, 3]."""
        return self.heads - self.heads[PARENT_ROWS]


def grounded(body: Body, pose: Pose, floor_m: float = 0.0) -> Pose:
    """The pose shifted vertically so that the lowest point of the skin is at `floor_m` [m]."""
    lowest = float(body.skin(pose)[:, 2].min())
    return pose.moved(np.array([0.0, 0.0, floor_m - lowest]))


def frame_of(along: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """Axes as columns [3, 3]: along a segment, about its hinge as far as at right angles to it."""
    first = along / np.linalg.norm(along)
    second = hinge - (hinge @ first) * first
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)], axis=1)
