# SPDX-License-Identifier: Apache-2.0
"""Faces around antennas, and which of them each antenna sees."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Bool, Float64

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh, build_bvh
from rfgs_core.simulate.geometry.faces import Faces, height
from rfgs_core.simulate.geometry.rays import crossings
from rfgs_core.threads import in_threads

#: Surfaces in front of a face are counted up to this many.
MOST_HIDDEN = 2
#: Surfaces in front of a place that nobody has counted yet.
_UNKNOWN = -1


class Surroundings(NamedTuple):
    """Faces, antennas, and what stands between them; the same for every search among them."""

    faces: Faces
    """The faces."""
    tx_xyz: np.ndarray
    """Transmitters [m], shape (tx, 3)."""
    rx_xyz: np.ndarray
    """Receivers [m], shape (rx, 3)."""
    tx_hidden: np.ndarray
    """Fewest surfaces between each transmitter and each face, up to 2, shape (tx, face)."""
    rx_hidden: np.ndarray
    """Fewest surfaces between each receiver and each face, up to 2, shape (rx, face)."""


class Sight:
    """What antennas that stay see of faces, some of which move from call to call.

    What stands still is looked at once: the surfaces that do not move in front of a place that
    does not move are counted when they are first asked for, and kept.
    """

    def __init__(
        self, tx_xyz: Float64[np.ndarray, "tx 3"], rx_xyz: Float64[np.ndarray, "rx 3"]
    ) -> None:
        """Sees nothing yet.

        Args:
            tx_xyz: Transmitters [m].
            rx_xyz: Receivers [m].
        """
        self._tx, self._rx = (
            np.ascontiguousarray(xyz, dtype=np.float64) for xyz in (tx_xyz, rx_xyz)
        )
        self._places = np.concatenate([self._tx, self._rx])
        self._still = np.zeros((0, 3, 3))
        self._bvh = build_bvh(self._still)
        self._samples = np.zeros((0, 3))
        self._behind = np.zeros((len(self._places), 0), dtype=np.int8)

    def of(self, faces: Faces, moves: Bool[np.ndarray, "triangle"]) -> Surroundings:
        """Looks from every antenna at every face.

        Args:
            faces: What there is.
            moves: Which of its triangles may stand elsewhere in another call. What is seen does
                not depend on it.
        """
        moving = np.zeros(len(faces.normal), dtype=bool)
        known = faces.of_triangle >= 0
        moving[faces.of_triangle[known]] = moves[known]
        sample_moves = np.repeat(moving, np.diff(faces.sample_start))
        self._keep(_triangles(faces, ~moves), faces.samples[~sample_moves])
        kept = np.where(sample_moves, -1, np.cumsum(~sample_moves) - 1)
        others = build_bvh(_triangles(faces, moves))

        def seen_by(site: int) -> np.ndarray:
            place, behind = self._places[site], self._behind[site]
            return _hidden(faces, place, self._bvh, others, kept, behind)

        rows = in_threads(seen_by, range(len(self._places)))
        hidden = np.array(rows, dtype=np.int64).reshape(len(rows), len(faces.normal))
        split = len(self._tx)
        return Surroundings(faces, self._tx, self._rx, hidden[:split], hidden[split:])

    def _keep(self, still: np.ndarray, samples: np.ndarray) -> None:
        """Forgets what was counted where something else stands still than in the last call."""
        if not np.array_equal(still, self._still):
            self._still, self._bvh = still, build_bvh(still)
        elif np.array_equal(samples, self._samples):
            return
        self._samples = samples
        self._behind = np.full((len(self._places), len(samples)), _UNKNOWN, dtype=np.int8)


def surroundings(
    faces: Faces, tx_xyz: Float64[np.ndarray, "tx 3"], rx_xyz: Float64[np.ndarray, "rx 3"]
) -> Surroundings:
    """Looks from every antenna at every face, none of which moves.

    Args:
        faces: What there is.
        tx_xyz: Transmitters [m].
        rx_xyz: Receivers [m].
    """
    return Sight(tx_xyz, rx_xyz).of(faces, np.zeros(len(faces.of_triangle), dtype=bool))


def _triangles(faces: Faces, which: np.ndarray) -> np.ndarray:
    """Corners of some triangles [m], shape (triangle, 3, 3), as they were given."""
    given = np.zeros_like(faces.bvh.corners)
    given[faces.bvh.triangle] = faces.bvh.corners
    return given[which]


@numba.njit(cache=True, nogil=True)
def _hidden(
    faces: Faces, place: np.ndarray, still: Bvh, moving: Bvh, kept: np.ndarray, behind: np.ndarray
) -> np.ndarray:
    """Fewest surfaces between a place and any of each face's samples, at most two, (face,).

    Args:
        faces: The faces.
        place: The place [m], shape (3,).
        still: Triangles that stand still.
        moving: The others.
        kept: Where in `behind` each sample stands, −1 for those that move.
        behind: Surfaces that stand still before samples that do; what is not known is filled in.
    """
    count = len(faces.normal)
    out = np.full(count, MOST_HIDDEN, dtype=np.int64)
    at_m, triangle = np.zeros(MOST_HIDDEN), np.zeros(MOST_HIDDEN, dtype=np.int64)
    rim_m = 2.0 * SAME_M
    samples = faces.samples
    for face in range(count):
        if abs(height(faces, face, place)) < SAME_M:
            continue
        for i in range(faces.sample_start[face], faces.sample_start[face + 1]):
            # No need to know by how many more than so far.
            room = out[face] - 1
            if kept[i] < 0:
                found = crossings(still, place, samples[i], rim_m, at_m[:room], triangle)
            else:
                if behind[kept[i]] == _UNKNOWN:
                    behind[kept[i]] = crossings(
                        still, place, samples[i], rim_m, at_m[: MOST_HIDDEN - 1], triangle
                    )
                found = int(behind[kept[i]])
            if found <= room:
                found += crossings(moving, place, samples[i], rim_m, at_m[:room], triangle)
            out[face] = min(out[face], found)
            if out[face] == 0:
                break
    return out
