# SPDX-License-Identifier: Apache-2.0
"""Non-negative powers whose matched-filter images add up to the one that is seen.

Points of a surface that is rough to the wave echo with unrelated phases, so powers of their
images add; which are there is then a deconvolution with powers that cannot be negative (DAMAS,
Brooks and Humphreys, J. Sound Vib. 294, 2006), solved by the active sets of Lawson and Hanson.
Every device pair sees another side of a body, so each has powers of its own, joined as the pairs
of the matched filter are: on three frames of `corridor` that was better than powers in common.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from rfgs_core.evaluate.baselines.lattice import Lattice, lattice_of
from rfgs_core.evaluate.baselines.scatterers import shown
from rfgs_core.evaluate.evidence import BaselineResult, Evidence

#: Ridge of the normal equations, relative to their mean diagonal.
RIDGE = 1e-9
#: Power that every voxel has at least, relative to a pair's total: one pair that sees nothing at a
#: place should not take it from all others.
FLOOR = 1e-7


def baseline(evidence: Evidence) -> BaselineResult:
    """Points and their powers, shown with a round beam, log-mean over device pairs."""
    lattice = lattice_of(evidence)
    if lattice is None:
        return BaselineResult(reason="the frame holds no energy")
    score = np.zeros(evidence.grid.shape, dtype=np.float32)
    for pair in lattice.heard:
        image = shown(evidence.grid, lattice.points, powers(lattice, pair))
        # The logarithm of the floored power, less that of the floor alone, which most voxels have.
        some = image > 0.0
        score[some] += np.log1p(image[some] / FLOOR)
    return BaselineResult(score=score, reason="powers without phases; they predict no channel")


def powers(lattice: Lattice, pair: int) -> Float[np.ndarray, "N"]:
    """Reflected power of every lattice point as one device pair sees it; their sum is one."""
    count = len(lattice.points)
    image = np.abs(lattice.alike[pair].astype(np.complex128)) ** 2
    normal = image.T @ image
    normal += RIDGE * np.trace(normal) / count * np.eye(count)
    wanted = image.T @ np.abs(lattice.echo[pair].astype(np.complex128)) ** 2
    # ‖Lᵀw − L⁻¹b‖² has the same normal equations, with as many rows as there are points.
    factor = np.linalg.cholesky(normal)
    found = nnls(factor.T, np.linalg.solve(factor, wanted), maxiter=10 * count)[0]
    return found / found.sum()
