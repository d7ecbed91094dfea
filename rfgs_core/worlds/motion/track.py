# SPDX-License-Identifier: Apache-2.0
"""A motion in the making: rotations of all bones and the root at every sample."""

from __future__ import annotations

import numpy as np

from rfgs_core.articulated import BONES, PARENTS, Body, Pose
from rfgs_core.articulated.bones import bone
from rfgs_core.worlds.motion.curves import X, Y, Z, about, smoothed
from rfgs_core.worlds.motion.motion import RATE_HZ, Motion, Plate

SIDES = ("left", "right")
#: Signs with which rotations about x and z count on each side.
SIGN = {"left": 1.0, "right": -1.0}


class Track:
    """Rotations against the parents from the anatomical position, and the root, over time.

    Angles follow clinical use: flexion ahead, abduction to the outside, rotation outwards; of
    the trunk ahead, to the left and turning left.
    """

    def __init__(self, body: Body, duration_s: float) -> None:
        """Begins with the anatomical position at the origin.

        Args:
            body: Who moves.
            duration_s: How long [s].
        """
        count = max(round(duration_s * RATE_HZ), 2) + 1
        self.body = body
        self.times = np.arange(count) / RATE_HZ
        self.local = np.tile(np.eye(3), (count, len(BONES), 1, 1))
        self.root = np.tile(body.heads[0], (count, 1))
        self.floor_m = np.zeros(count)
        self.plates: tuple[Plate, ...] = ()

    def pelvis(
        self,
        heading: np.ndarray | float = 0.0,
        flexion: np.ndarray | float = 0.0,
        bend: np.ndarray | float = 0.0,
        twist: np.ndarray | float = 0.0,
    ) -> None:
        """Turns the pelvis: where it looks, tilt ahead, tilt to the left, twist to the left."""
        turn = about(Z, heading + twist) @ about(Y, flexion) @ about(X, -bend)
        self.local[:, 0] = turn

    def trunk(
        self,
        flexion: np.ndarray | float = 0.0,
        bend: np.ndarray | float = 0.0,
        twist: np.ndarray | float = 0.0,
    ) -> None:
        """Bends the three parts of the spine, more of the twist the higher up."""
        for name, share, turning in (
            ("spine_lower", 0.4, 0.2),
            ("spine_middle", 0.35, 0.35),
            ("spine_upper", 0.25, 0.45),
        ):
            self.local[:, bone(name)] = (
                about(Z, turning * twist) @ about(Y, share * flexion) @ about(X, -share * bend)
            )

    def gaze(
        self,
        flexion: np.ndarray | float = 0.0,
        bend: np.ndarray | float = 0.0,
        twist: np.ndarray | float = 0.0,
    ) -> None:
        """Turns head and neck, half each."""
        turn = about(Z, 0.5 * twist) @ about(Y, 0.5 * flexion) @ about(X, -0.5 * bend)
        self.local[:, bone("neck")] = turn
        self.local[:, bone("head")] = turn

    def leg(
        self,
        side: str,
        hip: np.ndarray | float = 0.0,
        knee: np.ndarray | float = 0.0,
        ankle: np.ndarray | float = 0.0,
        abduction: np.ndarray | float = 0.0,
        rotation: np.ndarray | float = 0.0,
    ) -> None:
        """Sets a leg from its angles; the ankle's is positive where the toes are lifted."""
        sign = SIGN[side]
        self.local[:, bone(f"upperleg_{side}")] = (
            about(X, sign * abduction) @ about(Y, -hip) @ about(Z, sign * rotation)
        )
        self.local[:, bone(f"lowerleg_{side}")] = about(Y, knee)
        self.local[:, bone(f"foot_{side}")] = about(Y, -ankle)

    def world(self) -> np.ndarray:
        """Rotations of all bones against the world, from neutral, shape [T, B, 3, 3]."""
        out = self.local.copy()
        for row, parent in enumerate(PARENTS):
            if parent >= 0:
                out[:, row] = out[:, parent] @ self.local[:, row]
        return out

    def heads(self, world: np.ndarray | None = None) -> np.ndarray:
        """Where all bones begin [m], shape [T, B, 3]."""
        turns = (self.world() if world is None else world) @ self.body.neutral
        out = np.zeros((len(self.times), len(BONES), 3))
        out[:, 0] = self.root
        for row, parent in enumerate(PARENTS):
            if parent >= 0:
                step = self.body.heads[row] - self.body.heads[parent]
                out[:, row] = out[:, parent] + turns[:, parent] @ step
        return out

    def lowest(self) -> np.ndarray:
        """Height of the lowest point of the skin [m], shape [T]."""
        turns = self.world() @ self.body.neutral
        poses = (Pose(root, turn) for root, turn in zip(self.root, turns, strict=True))
        return np.array([self.body.skin(pose)[:, 2].min() for pose in poses])

    def ground(self, above_m: np.ndarray | float = 0.0, width_s: float = 0.03) -> None:
        """Shifts the root vertically until the lowest skin is on the floor, or above it."""
        wanted = self.root[:, 2] + self.floor_m + above_m - self.lowest()
        self.root[:, 2] = smoothed(wanted, RATE_HZ, width_s)

    def motion(self, family: str) -> Motion:
        """The finished motion."""
        neutral = self.body.neutral
        return Motion(family, neutral, self.local, self.root, self.floor_m, self.plates)
