# SPDX-License-Identifier: Apache-2.0
"""The room around the people of a scene, as the add-on found it by rays from where they are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit


@dataclass(frozen=True)
class Room:
    """Where antennas are among the people."""

    box_m: np.ndarray
    """Floor, ceiling and walls [m], the scene's bounds where there is none, shape (2, 3)."""
    stand_m: np.ndarray
    """Where people are, on the middle of their way [m], shape (3,)."""
    seen_m: np.ndarray
    """Places within the room that people see, their own first [m], shape (N, 3)."""

    def outside(self, place_m: np.ndarray, triangles: np.ndarray) -> bool:
        """Whether a place is under the floor, above the ceiling or sees nothing of the room.

        Args:
            place_m: The place [m], shape (3,).
            triangles: Everything that stands still [m], shape (T, 3, 3).
        """
        if not self.box_m[0, 2] <= place_m[2] <= self.box_m[1, 2]:
            return True
        near = np.argsort(np.linalg.norm(self.seen_m - place_m, axis=1), kind="stable")
        return not sees_any(place_m, self.seen_m[near], triangles)


def room_of_row(row: dict[str, Any] | None) -> Room | None:
    """The room of a bundle, from the entry `room` of its JSON; None where nothing stands still."""
    if row is None:
        return None
    shapes = {"box_m": (2, 3), "stand_m": (3,), "seen_m": (-1, 3)}
    values = {
        name: np.asarray(row[name], dtype=np.float64).reshape(shape)
        for name, shape in shapes.items()
    }
    return Room(**values)


@njit(cache=True, nogil=True)
def sees_any(place: np.ndarray, targets: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether a place has a line of sight to any target (Möller and Trumbore 1997).

    Compiled, since a place outside of everything is tried against all targets.

    Args:
        place: Where from [m], shape (3,), double.
        targets: Where to [m], shape (N, 3), the likeliest first.
        triangles: What is in the way [m], shape (T, 3, 3).
    """
    px, py, pz = place[0], place[1], place[2]
    for k in range(len(targets)):
        rx, ry, rz = targets[k, 0] - px, targets[k, 1] - py, targets[k, 2] - pz
        free = True
        for n in range(len(triangles)):
            x, y, z = triangles[n, 0, 0], triangles[n, 0, 1], triangles[n, 0, 2]
            ax, ay, az = triangles[n, 1, 0] - x, triangles[n, 1, 1] - y, triangles[n, 1, 2] - z
            bx, by, bz = triangles[n, 2, 0] - x, triangles[n, 2, 1] - y, triangles[n, 2, 2] - z
            cx, cy, cz = ry * bz - rz * by, rz * bx - rx * bz, rx * by - ry * bx
            det = ax * cx + ay * cy + az * cz
            if abs(det) < 1e-12:
                continue
            ox, oy, oz = px - x, py - y, pz - z
            u = (ox * cx + oy * cy + oz * cz) / det
            if u < 0.0 or u > 1.0:
                continue
            qx, qy, qz = oy * az - oz * ay, oz * ax - ox * az, ox * ay - oy * ax
            v = (rx * qx + ry * qy + rz * qz) / det
            if v < 0.0 or u + v > 1.0:
                continue
            t = (bx * qx + by * qy + bz * qz) / det
            if 1e-6 < t < 1.0 - 1e-6:
                free = False
                break
        if free:
            return True
    return False


def all_triangles(meshes: Iterable[Any]) -> np.ndarray:
    """Triangles [m] of all meshes, shape (T, 3, 3)."""
    corners = [mesh.vertices[mesh.faces].astype(np.float64) for mesh in meshes]
    return np.concatenate([np.zeros((0, 3, 3)), *corners])
