# SPDX-License-Identifier: Apache-2.0
"""CLEAN: take the brightest points out of the matched-filter map, again and again.

Högbom's loop (Astron. Astrophys. Suppl. 15, 1974) with major cycles in the manner of Schwab:
several well separated peaks per map, a loop gain of one half, every device pair with a
complex amplitude of its own.
"""

from __future__ import annotations

import numpy as np

from rfgs_core.encode.peaks import separated_peaks
from rfgs_core.evaluate.baselines.matched_filter import default_score
from rfgs_core.evaluate.baselines.scatterers import PointModel
from rfgs_core.evaluate.evidence import BaselineResult, Evidence
from rfgs_core.evaluate.geometry import best_voxels

#: Maps computed at most, and peaks taken from each.
CYCLES = 24
PEAKS_PER_CYCLE = 4
#: Share of a peak that is taken out at once.
LOOP_GAIN = 0.5
#: Peaks of one cycle keep this distance [m].
SEPARATION_M = 0.4
#: Peaks are looked for in this many times K voxels of the matched filter.
SEARCH_FACTOR = 3
#: Stop when a cycle lowers the residual power by less than this share.
LEAST_GAIN = 1e-3


def baseline(evidence: Evidence) -> BaselineResult:
    """Points found by CLEAN, shown with a round beam."""
    model = PointModel(evidence)
    search = best_voxels(default_score(evidence), SEARCH_FACTOR * evidence.voxels)
    if len(search) == 0:
        return BaselineResult(reason="the frame holds no energy")
    points = evidence.grid.centres(search)
    residual = model.measurements()
    total = sum(float(np.sum(np.abs(part) ** 2)) for part in residual)
    amplitude = np.zeros((len(model.pairs), len(points)), dtype=np.complex128)
    before = total
    for _ in range(CYCLES):
        answer = model.back_project(residual, points)
        power = np.sum(np.abs(answer) ** 2, axis=0)
        for best in separated_peaks(points, power, PEAKS_PER_CYCLE, SEPARATION_M):
            for pair in range(len(model.pairs)):
                step = LOOP_GAIN * answer[pair, best]
                residual[pair] = residual[pair] - step * model.steering(points[best], pair)
                amplitude[pair, best] += step
        after = sum(float(np.sum(np.abs(part) ** 2)) for part in residual)
        if before - after < LEAST_GAIN * total:
            break
        before = after
    used = np.abs(amplitude).sum(axis=0) > 0.0
    return model.result(points[used], amplitude[:, used])
