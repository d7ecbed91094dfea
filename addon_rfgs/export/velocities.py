# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast everything moves: each body segment of each person as a label, or each vertex."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ..scene.frames import seconds_per_frame
from ..scene.people import Instance, joints
from ..tables import JOINTS


def vertex_velocity(
    scene: bpy.types.Scene, frame: int, vertices: Callable[[int], np.ndarray]
) -> np.ndarray:
    """Velocities [m/s] of all vertices at a frame, float32 [V, 3], differences as for segments.

    Leaves the scene evaluated beside the frame.

    Args:
        scene: Gives frames and rate.
        frame: Frame number.
        vertices: As `SegmentVelocities` takes it.
    """
    first, last = _around(scene, frame)
    start = _evaluated(scene, first, vertices)
    way = _evaluated(scene, last, vertices) - start
    return (way / ((last - first) * seconds_per_frame(scene))).astype(np.float32)


def _around(scene: bpy.types.Scene, frame: int) -> tuple[float, float]:
    """Half a frame before and after, within the scene's range."""
    return max(frame - 0.5, float(scene.frame_start)), min(frame + 0.5, float(scene.frame_end))


def _evaluated(
    scene: bpy.types.Scene, frame: float, vertices: Callable[[int], np.ndarray]
) -> np.ndarray:
    """Puts the scene at a time between frames; all vertices [m], float64 [V, 3]."""
    whole = int(np.floor(frame))
    scene.frame_set(whole, subframe=frame - whole)
    return vertices(whole).astype(np.float64)


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
        first, last = _around(self._scene, frame)
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
        corners = _evaluated(self._scene, frame, self._vertices)[self._faces]
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
