# SPDX-License-Identifier: Apache-2.0
"""The nearest of some centres to each of many places, by a grid of the centres."""

from __future__ import annotations

import math

import numba
import numpy as np
from scipy.spatial import KDTree

#: Most cells of the grid for each centre: on a surface few of them hold any.
_CELLS_PER_CENTRE = 8
#: Squared distances that differ by this share of them are one, up to rounding.
_TIE = 1e-12

#: A centre, its squared distance [m²], and whether another one is as near.
_Found = tuple[int, float, bool]


class Cells:
    """Which centre is the nearest to each of many places, asked again and again.

    Neighbours are asked one after the other: no centre is farther than the last one's, which
    leaves a few cells of the grid to look into. Where two centres are as near, SciPy's tree says
    which: points of datasets stay where they were.
    """

    def __init__(self, places: np.ndarray, along: np.ndarray) -> None:
        """Args are the places, shape (N, 3), and their order along a space-filling curve."""
        self._ordered, self._along = places[along], along

    def around(self, centres: np.ndarray) -> np.ndarray:
        """Index of the nearest centre of each place, shape (N,)."""
        low = centres.min(axis=0)
        extent_m = centres.max(axis=0) - low
        side_m = _side(extent_m, len(centres))
        shape = (extent_m / side_m).astype(np.int64) + 1
        at = np.minimum(((centres - low) / side_m).astype(np.int64), shape - 1)
        flat = (at[:, 0] * shape[1] + at[:, 1]) * shape[2] + at[:, 2]
        member = np.argsort(flat, kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=shape.prod()))])
        cell = np.zeros(len(self._ordered), dtype=np.int64)
        found, tied = _nearest(self._ordered, centres, member, first, low, side_m, shape)
        if tied.any():
            found[tied] = KDTree(centres).query(self._ordered[tied])[1]
        cell[self._along] = found
        return cell


def _side(extent_m: np.ndarray, count: int) -> float:
    """Side of the grid's cells [m]: about as far as centres of a surface lie apart."""
    a, b, c = np.sort(np.maximum(extent_m, 1e-9))
    apart_m = math.sqrt((a * b + b * c + c * a) / count)
    return max(apart_m, (a * b * c / (_CELLS_PER_CENTRE * count)) ** (1.0 / 3.0))


@numba.njit(cache=True, nogil=True, inline="always")
def _range(at: float, low: float, reach: float, side: float, cells: int) -> tuple[int, int]:
    """First cell along an axis within reach of a place, and the one after the last."""
    begin = math.floor((at - reach - low) / side)
    end = math.floor((at + reach - low) / side) + 1
    # One more on each side: rounding may put a centre beside the cell that it lies in.
    return max(begin - 1, 0), min(end + 1, cells)


@numba.njit(cache=True, nogil=True, inline="always")
def _beyond(at: float, low: float, cell: int, side: float) -> float:
    """Distance along an axis from a place to a cell, 0 inside [m]."""
    begin = low + cell * side
    slack = 1e-6 * side
    return max(max(begin - slack - at, at - begin - side - slack), 0.0)


@numba.njit(cache=True, nogil=True, inline="always")
def _nearer(
    at: tuple[float, float, float], centres: np.ndarray, among: np.ndarray, so_far: _Found
) -> _Found:
    """The nearest so far, or one among others that is nearer."""
    found, best, tied = so_far
    for c in among:
        dx, dy, dz = at[0] - centres[c, 0], at[1] - centres[c, 1], at[2] - centres[c, 2]
        d = dx * dx + dy * dy + dz * dz
        if c != found and abs(d - best) <= _TIE * best:
            tied = True
        elif d < best:
            tied = False
        if d < best:
            best, found = d, c
    return found, best, tied


@numba.njit(cache=True, nogil=True)
def _nearest(
    places: np.ndarray,
    centres: np.ndarray,
    member: np.ndarray,
    first: np.ndarray,
    low: np.ndarray,
    side: float,
    shape: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Index of the centre nearest to each place, and whether another is as near, each shape (N,).

    Args:
        places: The places [m], neighbours one after the other, shape (N, 3).
        centres: The centres [m], shape (M, 3).
        member: Centres, cell by cell, shape (M,).
        first: Where each cell begins in `member`, and the end of the last.
        low: Lowest corner of the grid [m], shape (3,).
        side: Side of its cells [m].
        shape: Cells along each axis, shape (3,).
    """
    out = np.zeros(len(places), dtype=np.int64)
    tied = np.zeros(len(places), dtype=np.bool_)
    found = 0
    for p in range(len(places)):
        x, y, z = places[p, 0], places[p, 1], places[p, 2]
        dx, dy, dz = x - centres[found, 0], y - centres[found, 1], z - centres[found, 2]
        best, other = dx * dx + dy * dy + dz * dz, False
        reach = math.sqrt(best)
        x0, x1 = _range(x, low[0], reach, side, shape[0])
        y0, y1 = _range(y, low[1], reach, side, shape[1])
        z0, z1 = _range(z, low[2], reach, side, shape[2])
        for i in range(x0, x1):
            away_x = _beyond(x, low[0], i, side) ** 2
            if away_x > best:
                continue
            for j in range(y0, y1):
                away_y = away_x + _beyond(y, low[1], j, side) ** 2
                if away_y > best:
                    continue
                for k in range(z0, z1):
                    cell = (i * shape[1] + j) * shape[2] + k
                    begin, end = first[cell], first[cell + 1]
                    if begin < end and away_y + _beyond(z, low[2], k, side) ** 2 <= best:
                        so_far = found, best, other
                        found, best, other = _nearer((x, y, z), centres, member[begin:end], so_far)
        out[p], tied[p] = found, other
    return out, tied
