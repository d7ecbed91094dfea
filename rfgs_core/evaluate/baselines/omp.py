# SPDX-License-Identifier: Apache-2.0
"""Orthogonal matching pursuit: pick the best point, refit all amplitudes, repeat.

The dictionary is searched coarsely, then around the best coarse point; all device pairs share
the points and keep their own complex amplitudes (simultaneous OMP, Tropp et al. 2006).
"""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.baselines.matched_filter import default_score
from rfgs_core.evaluate.baselines.scatterers import PointModel
from rfgs_core.evaluate.evidence import BaselineResult, Evidence
from rfgs_core.evaluate.geometry import best_voxels

#: Points picked.
ATOMS = 32
#: The coarse dictionary holds every n-th of these many times K matched-filter voxels.
SEARCH_FACTOR = 3
COARSE_STEP = 4
#: Radius of the fine search around the best coarse point [m].
REFINE_M = 0.09
#: Ridge added to the normal equations, relative to their diagonal.
RIDGE = 1e-3


def _refit(atoms: list[np.ndarray], measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares amplitudes of the atoms of one pair, and what they leave over."""
    basis = np.stack([atom.ravel() for atom in atoms], axis=1)
    gram = basis.conj().T @ basis
    gram += RIDGE * len(basis) * np.eye(len(atoms))
    amplitude = np.linalg.solve(gram, basis.conj().T @ measured.ravel())
    return amplitude, measured - (basis @ amplitude).reshape(measured.shape)


def _best_point(
    model: PointModel, residual: list[np.ndarray], coarse: np.ndarray, fine: np.ndarray
) -> np.ndarray:
    """The point that explains most of the residual, coarse search first."""
    power = np.sum(np.abs(model.back_project(residual, coarse)) ** 2, axis=0)
    around = coarse[int(power.argmax())]
    near = fine[np.linalg.norm(fine - around, axis=1) <= REFINE_M]
    power = np.sum(np.abs(model.back_project(residual, near)) ** 2, axis=0)
    return near[int(power.argmax())]


def baseline(evidence: Evidence) -> BaselineResult:
    """Points found by OMP, shown with a round beam."""
    model = PointModel(evidence)
    search = best_voxels(default_score(evidence), SEARCH_FACTOR * evidence.voxels)
    if len(search) == 0:
        return BaselineResult(reason="the frame holds no energy")
    fine = evidence.grid.centres(search)
    coarse = evidence.grid.centres(np.sort(search)[::COARSE_STEP])
    measured = model.measurements()
    residual = measured
    atoms: list[list[np.ndarray]] = [[] for _ in model.pairs]
    picked: list[np.ndarray] = []
    amplitude = np.zeros((len(model.pairs), 0), dtype=np.complex128)
    for _ in range(ATOMS):
        point = _best_point(model, residual, coarse, fine)
        if any(np.array_equal(point, other) for other in picked):
            break
        picked.append(point)
        for pair, chosen in enumerate(atoms):
            chosen.append(model.steering(point, pair))
        fits = [_refit(chosen, part) for chosen, part in zip(atoms, measured, strict=True)]
        amplitude = np.stack([fit[0] for fit in fits])
        residual = [fit[1] for fit in fits]
    return model.result(np.stack(picked), amplitude)
