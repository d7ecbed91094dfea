# SPDX-License-Identifier: Apache-2.0
"""Where a radio would hear somebody, as a map over the floor: the radar equation, straight ways."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from rfgs_core.dataset import Sequence
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.levels import decibels
from rfgs_core.simulate.geometry.bvh import build_bvh
from rfgs_core.simulate.sight.free import free_segments

#: Height of the places above the floor, and of the drawn map [m].
HEIGHT_M, DRAWN_M = 1.0, 0.02
#: Side of a cell, and cells along a side at most [m].
_CELL_M, _MOST_CELLS = 0.2, 120
#: Colours are spread between these percentiles of the places, over at least so much [dB].
PERCENTILES, LEAST_SPAN_DB = (4.0, 94.0), 3.0
#: Places this near to a device are as strong as those at this distance [m].
_NEAREST_M = 0.3


@dataclass(frozen=True)
class Coverage:
    """Power of the echo of a square metre at every place, all links together."""

    x_m: Float64[np.ndarray, "x"]
    """Middles of the cells [m]."""
    y_m: Float64[np.ndarray, "y"]
    floor_m: float
    """Height of the floor [m]."""
    power_db: Float64[np.ndarray, "x y"]
    """Against what is sent [dB]; minus infinity where no link reaches."""

    @property
    def edges_m(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the map begins and ends along x and y [m]."""
        return _ends(self.x_m), _ends(self.y_m)

    @property
    def scale_db(self) -> tuple[float, float]:
        """Powers of the first and the last colour [dB]: most places lie between them."""
        known = self.power_db[np.isfinite(self.power_db)]
        if not len(known):
            return -1.0, 0.0
        low, high = np.percentile(known, PERCENTILES)
        return float(low), float(max(high, low + LEAST_SPAN_DB))


def _ends(middles_m: Float64[np.ndarray, "cell"]) -> tuple[float, float]:
    half = 0.5 * float(middles_m[1] - middles_m[0])
    return float(middles_m[0]) - half, float(middles_m[-1]) + half


def coverage_of(sequence: Sequence, radio: str) -> Coverage | None:
    """The map of a radio: Σ λ² / ((4π)³ d_t² d_r²) over the links that see a place from both ends.

    What stands still hides, whatever it is made of; nothing reflects. None where antennas move.
    """
    spec = sequence.radio_spec(radio)
    if spec.antennas_move:
        return None
    floor, triangles = _floor_and_walls(sequence)
    low, high = np.asarray(sequence.bounds_m, np.float64)[:, :2]
    x, y = (_middles(low[axis], high[axis]) for axis in range(2))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    places = np.hstack([grid, np.full((len(grid), 1), floor + HEIGHT_M)])
    bvh, layout = build_bvh(triangles), sequence.layout(radio)
    # Array centres that several links share are asked once.
    reach: dict[tuple[float, ...], np.ndarray] = {}
    power = np.zeros(len(places))
    for pair in layout.device_pairs:
        ends = []
        for centre in layout.centres_of(*pair):
            key = tuple(np.round(centre, 3).tolist())
            if key not in reach:
                away = np.linalg.norm(places - centre, axis=1)
                free = free_segments(bvh, np.tile(centre, (len(places), 1)), places)
                reach[key] = free / np.maximum(away, _NEAREST_M) ** 2
            ends.append(reach[key])
        power += ends[0] * ends[1]
    power *= (SPEED_OF_LIGHT / spec.centre_hz) ** 2 / (4.0 * math.pi) ** 3
    level = np.full(len(power), -np.inf)
    level[power > 0.0] = decibels(power[power > 0.0])
    return Coverage(x, y, floor, level.reshape(len(x), len(y)))


def _floor_and_walls(sequence: Sequence) -> tuple[float, np.ndarray]:
    """Height of the floor [m] and the triangles that stand still [m], (T, 3, 3)."""
    if not sequence.files.static_mesh.is_file():
        return float(sequence.bounds_m[0][2]), np.zeros((0, 3, 3))
    vertices, faces = sequence.static_mesh()
    triangles = vertices[faces].astype(np.float64)
    floor = triangles[..., 2].min() if len(faces) else sequence.bounds_m[0][2]
    return float(floor), triangles


def _middles(low_m: float, high_m: float) -> Float64[np.ndarray, "cell"]:
    """Middles of cells between two ends [m], two cells at least."""
    count = min(max(math.ceil((high_m - low_m) / _CELL_M), 2), _MOST_CELLS)
    edges = np.linspace(low_m, high_m, count + 1)
    return 0.5 * (edges[1:] + edges[:-1])
