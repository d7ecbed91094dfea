# SPDX-License-Identifier: Apache-2.0
"""MUSIC: points whose echo lies in the subspace of what a device pair hears.

One frame is one snapshot; more come of shifting a window along the subcarriers, over which a
path only turns its phase (spatial smoothing, Shan, Wax and Kailath 1985; in delay and angle
together, Kotaru et al. 2015). A window holds all links of the pair, so that delay and both angles
are told at once, of spherical waves. The score is the pseudo-spectrum of Schmidt (IEEE Trans.
Antennas Propag. 34, 1986), log-mean over pairs.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex64, Float, Float64, Int64

from rfgs_core.evaluate.baselines.matched_filter import default_score
from rfgs_core.evaluate.baselines.scatterers import PointModel
from rfgs_core.evaluate.evidence import BaselineResult, Evidence
from rfgs_core.evaluate.geometry import best_voxels
from rfgs_core.evaluate.grid import Grid

#: Points are looked for in this many times K voxels of the matched filter, as those of CLEAN are.
SEARCH_FACTOR = 3
#: A window holds every n-th of this many subcarriers at most, and half of the longest run.
STEP_SUBCARRIERS = 2
MOST_SUBCARRIERS = 100
#: Dimensions of the subspace, chosen on three frames of `corridor`; a body has no number of points.
SOURCES = 12
#: What no point may lack of its echo: single precision tells no less.
LEAST_OUTSIDE = 1e-6
#: Points whose echoes are made at once.
CHUNK = 1024
#: A search of more voxels looks at blocks of them: vehicles have tens of thousands.
MOST_POINTS = 10_000


def baseline(evidence: Evidence) -> BaselineResult:
    """The pseudo-spectrum where the matched filter is strong."""
    model = PointModel(evidence)
    heard = {pair: values for pair, values in enumerate(model.measurements()) if np.any(values)}
    window = window_of(model.subcarriers)
    if not heard:
        return BaselineResult(reason="the frame holds no energy")
    if len(window) < 2:
        return BaselineResult(reason="no four neighbouring subcarriers are visible, so no shifts")
    search = best_voxels(default_score(evidence), SEARCH_FACTOR * evidence.voxels)
    points, block = blocks_of(evidence.grid, search)
    total = np.zeros(len(points))
    for pair, measured in heard.items():
        total += pseudo_spectrum(model, pair, measured, window, points)
    score = np.zeros(evidence.grid.size, dtype=np.float32)
    # The faintest point still is before everything that was not looked at.
    score[search] = (total - total.min() + LEAST_OUTSIDE)[block]
    score = score.reshape(evidence.grid.shape)
    return BaselineResult(score=score, reason="a pseudo-spectrum; it predicts no channel")


def blocks_of(
    grid: Grid, search: Int64[np.ndarray, "V"], most: int = MOST_POINTS
) -> tuple[Float64[np.ndarray, "N 3"], Int64[np.ndarray, "V"]]:
    """Centres [m] of the smallest cubic blocks that are few enough, and the block of each voxel."""
    cells = np.stack(np.unravel_index(search, grid.shape), axis=1)
    edge = 1
    while True:
        blocks, block = np.unique(cells // edge, axis=0, return_inverse=True)
        if len(blocks) <= most:
            break
        edge += 1
    return grid.origin_m + (blocks + 0.5) * edge * grid.voxel_m, block.ravel()


def runs_of(subcarriers: Int64[np.ndarray, "visible"]) -> list[Int64[np.ndarray, "run"]]:
    """Visible subcarriers in runs of neighbours."""
    return np.split(subcarriers, np.flatnonzero(np.diff(subcarriers) != 1) + 1)


def window_of(subcarriers: Int64[np.ndarray, "visible"]) -> Int64[np.ndarray, "window"]:
    """Offsets of a window's subcarriers from its first."""
    longest = max(len(run) for run in runs_of(subcarriers))
    return np.arange(0, min(longest // 2, MOST_SUBCARRIERS), STEP_SUBCARRIERS)


def pseudo_spectrum(
    model: PointModel,
    pair: int,
    measured: Complex64[np.ndarray, "link visible"],
    window: Int64[np.ndarray, "window"],
    points: Float[np.ndarray, "N 3"],
) -> Float[np.ndarray, "N"]:
    """Logarithm of one over the share of a point's echo outside the subspace.

    Args:
        model: Echoes of points.
        pair: Which device pair.
        measured: Its entries, not all zero.
        window: Offsets of a window's subcarriers.
        points: Where to look [m].
    """
    place = {subcarrier: index for index, subcarrier in enumerate(model.subcarriers)}
    snapshots = [
        measured[:, place[run[0]] + start + window].ravel()
        for run in runs_of(model.subcarriers)
        for start in range(len(run) - int(window[-1]))
    ]
    left, size, _ = np.linalg.svd(np.stack(snapshots, axis=1), full_matrices=False)
    known = size > LEAST_OUTSIDE * size[0]
    subspace = left[:, known][:, :SOURCES].conj().T
    # A path's phase turns with the shift on all links nearly alike: any window's echo will do.
    middle = model.subcarriers[0] + (len(model.subcarriers) - int(window[-1])) // 2
    found = np.zeros(len(points))
    for first in range(0, len(points), CHUNK):
        part = slice(first, first + CHUNK)
        echoes = model.phasors(points[part], pair, middle + window)
        inside = np.sum(np.abs(subspace @ echoes.reshape(-1, echoes.shape[-1])) ** 2, axis=0)
        share = inside / (echoes.shape[0] * echoes.shape[1])
        found[part] = -np.log(np.maximum(1.0 - share, LEAST_OUTSIDE))
    return found
