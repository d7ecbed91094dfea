# SPDX-License-Identifier: Apache-2.0
"""Which paths a body stands beside, with no wall between the two.

A shadow is what the wave at the body does not bring to the receiver. Behind a wall there is as
good as no such wave: on its way to the body and back it would have to pass the wall twice. Paths
that go through the wall themselves are segments on either side, and are shaded there.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

#: Places on a body, at most, any of which may be in sight.
PLACES = 24
#: Points on a segment keep this distance from its ends, which lie on walls [m].
_MARGIN_M = 0.01


def segments_in_view(
    visible: Callable[[np.ndarray, np.ndarray], np.ndarray],
    corners: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    wanted: np.ndarray | None = None,
) -> np.ndarray:
    """Whether any of a body is in sight from where segments of paths pass it.

    Args:
        visible: Tells whether nothing but the body stands between places and places [m], both of
            shape (point, 3).
        corners: Corners of paths [m], shape (path, corner, 3).
        vertices: Vertices of the body [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        wanted: Segments to look from, bool, shape (path, corner - 1); None takes all.

    Returns:
        One value per segment, False where it is not wanted, bool, shape (path, corner - 1).
    """
    start, way = corners[:, :-1], np.diff(corners, axis=1)
    if not start.size:
        return np.zeros(start.shape[:2], dtype=bool)
    length = np.maximum(np.linalg.norm(way, axis=2), 2 * _MARGIN_M)
    share = ((vertices.mean(axis=0) - start) * way).sum(axis=2) / length**2
    share = np.clip(share, _MARGIN_M / length, 1 - _MARGIN_M / length)
    if wanted is None:
        wanted = np.ones(share.shape, dtype=bool)
    foot = (start + share[..., None] * way)[wanted]
    # Not vertices: those of a simple mesh are its corners, which may stick in floor and ceiling.
    places = vertices[faces[:: -(-len(faces) // PLACES)]].mean(axis=1)
    seen = visible(np.repeat(foot, len(places), axis=0), np.tile(places, (len(foot), 1)))
    out = np.zeros(share.shape, dtype=bool)
    out[wanted] = seen.reshape(len(foot), len(places)).any(axis=1)
    return out
