# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast each body segment of each person moves, as a label."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from .frames import seconds_per_frame
from .people import Instance, joints
from .tables import JOINTS


class SegmentVelocities:
    """Velocities of the centres of body segments, from the animation around each frame."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        people: list[Instance],
        topology: dict[str, np.ndarray],
        vertices: Callable[[int], np.ndarray],
    ) -> None:
        """Prepares the labels.

        Args:
            scene: Gives frames and rate.
            people: Persons with joints, in the order of all labels.
            topology: `faces` [T, 3], and `instance` and `segment` [T] of everything that moves.
            vertices: Called with a frame number; the vertices [V, 3] that move, in metres, of
                the scene as it is evaluated then.
        """
        self._scene, self._people, self._vertices = scene, people, vertices
        self._faces = topology["faces"]
        # One number per person and segment; faces of nobody fall into a bin of their own.
        self._bin = np.full(len(self._faces), len(people) * len(JOINTS))
        for index, person in enumerate(people):
            own = (topology["instance"] == person.id) & (topology["segment"] >= 0)
            self._bin[own] = index * len(JOINTS) + topology["segment"][own]
        self._before: tuple[float, np.ndarray] | None = None

    def at(self, frame: int) -> np.ndarray:
        """Velocities [m/s] at a frame, float32 [P, 17, 3]: a central difference over one frame.

        One-sided at both ends of the scene's range, where the animation may stop. Leaves the
        scene evaluated beside the frame.
        """
        if not self._people:
            return np.zeros((0, len(JOINTS), 3), np.float32)
        first = max(frame - 0.5, float(self._scene.frame_start))
        last = min(frame + 0.5, float(self._scene.frame_end))
        start = self._before[1] if self._before and self._before[0] == first else None
        start = self._centres(first) if start is None else start
        end = self._centres(last)
        self._before = (last, end)
        time_s = (last - first) * seconds_per_frame(self._scene)
        return ((end - start) / time_s).astype(np.float32)

    def _centres(self, frame: float) -> np.ndarray:
        """Centre [m] of every segment's skin, weighted by area, [P, 17, 3] float64.

        A segment without skin of its own has its joint instead.
        """
        whole = int(np.floor(frame))
        self._scene.frame_set(whole, subframe=frame - whole)
        corners = self._vertices(whole).astype(np.float64)[self._faces]
        sides = corners[:, 1:] - corners[:, :1]
        area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        count = len(self._people) * len(JOINTS)
        total = np.bincount(self._bin, area, count + 1)[:count]
        out = joints(self._scene, self._people).astype(np.float64).reshape(count, 3)
        skin = total > 0
        for axis in range(3):
            middle = corners[:, :, axis].mean(axis=1)
            weighted = np.bincount(self._bin, area * middle, count + 1)[:count]
            out[skin, axis] = weighted[skin] / total[skin]
        return out.reshape(len(self._people), len(JOINTS), 3)
