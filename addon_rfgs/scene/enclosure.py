# SPDX-License-Identifier: GPL-3.0-or-later
"""Which points are inside a closed object, as the dataset factory decides it."""

from __future__ import annotations

import numpy as np

from ..tables import ROOM_FRACTION


def enclosed(
    points: np.ndarray, room: np.ndarray, vertices: np.ndarray, faces: np.ndarray
) -> np.ndarray:
    """Which points [N, 3] a closed mesh encloses, [N]; the room itself encloses none.

    Args:
        points: Places [m].
        room: Lower and upper corner [2, 3] of the room around the people, or of the scene [m].
        vertices: Vertices [V, 3] of the mesh [m].
        faces: Its triangles [T, 3].
    """
    inside = np.zeros(len(points), dtype=bool)
    if not len(faces):
        return inside
    volume = float(np.prod(np.maximum(room[1] - room[0], 1e-6)))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if np.prod(high - low) > ROOM_FRACTION * volume:
        return inside
    corners = vertices.astype(np.float64)[faces]
    for index in np.flatnonzero(((points > low) & (points < high)).all(axis=1)):
        inside[index] = abs(_turns(corners - points[index])) > 0.5
    return inside


def _turns(corners: np.ndarray) -> float:
    """How often triangles [T, 3, 3] wrap around the origin.

    Solid angle of a triangle after Van Oosterom and Strackee (1983), eq. 8.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    la, lb, lc = np.linalg.norm(corners, axis=2).T
    ab, bc, ca = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    return float(np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2 * np.pi))
