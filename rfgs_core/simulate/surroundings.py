# SPDX-License-Identifier: Apache-2.0
"""Faces around antennas, and which of them each antenna sees."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Float64

from rfgs_core.simulate.beams import hidden_by
from rfgs_core.simulate.faces import Faces

#: Surfaces in front of a face are counted up to this many.
MOST_HIDDEN = 2


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


def surroundings(
    faces: Faces, tx_xyz: Float64[np.ndarray, "tx 3"], rx_xyz: Float64[np.ndarray, "rx 3"]
) -> Surroundings:
    """Looks from every antenna at every face.

    Args:
        faces: What there is.
        tx_xyz: Transmitters [m].
        rx_xyz: Receivers [m].
    """
    tx_xyz, rx_xyz = (np.ascontiguousarray(xyz, dtype=np.float64) for xyz in (tx_xyz, rx_xyz))

    def hidden(xyz: np.ndarray) -> np.ndarray:
        with ThreadPoolExecutor(numba.get_num_threads()) as pool:
            rows = list(pool.map(lambda place: hidden_by(faces, place, MOST_HIDDEN), xyz))
        return np.stack(rows) if rows else np.zeros((0, len(faces.normal)), dtype=np.int64)

    return Surroundings(faces, tx_xyz, rx_xyz, hidden(tx_xyz), hidden(rx_xyz))
