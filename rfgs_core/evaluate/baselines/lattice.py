# SPDX-License-Identifier: Apache-2.0
"""Point scatterers on a lattice, and how alike their echoes are: the model of FISTA and NNLS.

Echoes y of a device pair are Φ a + noise, with a column of unit phasors for every lattice point.
All that both methods need of it is Φᴴy and ΦᴴΦ, which are small.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Complex64, Float, Float64, Int64
from scipy.linalg import get_blas_funcs

from rfgs_core.evaluate.baselines.matched_filter import default_score
from rfgs_core.evaluate.baselines.scatterers import PointModel
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.geometry import best_voxels

#: Upper triangle of αAAᴴ of single-precision complex numbers, in half the work of a product.
(_square,) = get_blas_funcs(("herk",), dtype=np.complex64)
#: Points are looked for in this many times K voxels of the matched filter, as those of CLEAN are.
SEARCH_FACTOR = 3
#: Every how many voxels a point lies along each axis, at least.
STEP_VOXELS = 2
#: More points than these lie further apart: what follows costs their square.
MOST_POINTS = 800


@dataclass(frozen=True)
class Lattice:
    """Lattice points and what one frame says of them; device pairs that hear nothing are zero."""

    model: PointModel
    """Echoes of points."""
    points: Float64[np.ndarray, "N 3"]
    """Lattice points [m]."""
    echo: Complex64[np.ndarray, "pair N"]
    """Φᴴy over the number of entries: what the matched filter makes of each point."""
    alike: Complex64[np.ndarray, "pair N N"]
    """ΦᴴΦ over the number of entries."""
    level: Float64[np.ndarray, "pair"]
    """Mean power of a pair's entries."""

    @property
    def heard(self) -> Int64[np.ndarray, "heard"]:
        """Device pairs that hear anything."""
        return np.flatnonzero(self.level > 0.0)


@lru_cache(maxsize=1)
def lattice_of(evidence: Evidence) -> Lattice | None:
    """The lattice of a frame, kept for the method that asks next; None where no energy is."""
    model = PointModel(evidence)
    measured = model.measurements()
    level = np.array([np.mean(np.abs(values) ** 2, dtype=np.float64) for values in measured])
    if not level.any():
        return None
    search = best_voxels(default_score(evidence), SEARCH_FACTOR * evidence.voxels)
    points = evidence.grid.centres(_thinned(search, evidence.grid.shape))
    count = len(measured), len(points)
    echo = np.zeros(count, dtype=np.complex64)
    alike = np.zeros((*count, count[1]), dtype=np.complex64)
    for pair in np.flatnonzero(level > 0.0):
        phasors = model.phasors(points, pair)
        rows = phasors.reshape(-1, len(points))
        echo[pair] = measured[pair].ravel() @ rows.conj() / len(rows)
        upper = _square(1.0 / len(rows), rows.T).conj()
        alike[pair] = upper + np.triu(upper, 1).conj().T
    return Lattice(model, points, echo, alike, level)


def _thinned(search: Int64[np.ndarray, "V"], shape: tuple[int, int, int]) -> np.ndarray:
    """Voxels of a search that lie on the finest lattice with few enough points."""
    cells = np.stack(np.unravel_index(search, shape), axis=1)
    step = STEP_VOXELS
    while (on := np.all(cells % step == 0, axis=1)).sum() > MOST_POINTS:
        step += 1
    # A search of few voxels may miss the lattice.
    return search[on] if on.any() else search


def power_at(
    lattice: Lattice, amplitude: Complex64[np.ndarray, "pair N"]
) -> Float[np.ndarray, "N"]:
    """Mean power of points over the pairs that hear anything, each by its own level.

    As in the matched filter, the pair that stands closest would decide alone otherwise.
    """
    heard = lattice.heard
    return np.mean(np.abs(amplitude[heard]) ** 2 / lattice.level[heard, None], axis=0)
