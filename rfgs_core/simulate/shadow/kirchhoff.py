# SPDX-License-Identifier: Apache-2.0
"""How much of each environment path gets past everything that moves.

Sionna's absorber casts a shadow without diffraction. Here each path is multiplied by the
Kirchhoff factor of the body's silhouette, T = 1 − (j s/λ) ∬ e^{−jπsρ²/λ} dA with
s = 1/d_1 + 1/d_2 along the unfolded path: one factor per segment and body, their product per
path. The silhouette is cut once per segment, from the centres of sites; antenna elements shift
it by where their own line crosses the plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numba
import numpy as np

from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow import silhouette
from rfgs_core.simulate.shadow.frequencies import Nodes, nodes_for
from rfgs_core.simulate.shadow.fresnel import FRESNEL, screen_factors
from rfgs_core.simulate.shadow.lattice import MOST_PLACES, lattice_factors, places_needed
from rfgs_core.simulate.shadow.near import FAR, near_segments, reach, relative_amplitude
from rfgs_core.simulate.shadow.outline import Outline
from rfgs_core.simulate.shadow.projection import project
from rfgs_core.simulate.shadow.unfold import unfold

Shadow = Literal["kirchhoff", "hard"]


@dataclass(frozen=True)
class Passed:
    """What is left of the paths that something shades; all others pass as they are."""

    path: np.ndarray
    """Which paths, ascending, int64, shape (shaded,)."""
    factor: np.ndarray
    """Factor on the amplitude, complex64, shape (shaded, tx place of the site, rx place of the
    site, grid); ports of one element share a place."""
    grid_hz: np.ndarray
    """Frequencies of the factors [Hz], shape (grid,); linear in between."""


#: Work of one look into the Fresnel table, relative to one complex product.
LOOK_UP = 4


def transmission(
    paths: PathSet,
    layout: Layout,
    outlines: list[Outline],
    grid_hz: np.ndarray,
    mode: Shadow,
) -> Passed:
    """Shadow factors of the paths that pass near a body.

    Args:
        paths: Environment paths.
        layout: Antenna elements; every site has equally many.
        outlines: Everybody's, for these paths.
        grid_hz: Frequencies of the factors [Hz], shape (grid,).
        mode: "kirchhoff", or "hard" for all or nothing.
    """
    tx_places = _places(layout.tx_xyz, layout.tx_site, layout.tx_port)
    rx_places = _places(layout.rx_xyz, layout.rx_site, layout.rx_port)
    lines, relative = unfold(paths), relative_amplitude(paths)
    near = [
        outline.in_view & near_segments(paths, outline.vertices, grid_hz.max())
        for outline in outlines
    ]
    shaded = np.flatnonzero(np.any([rows.any(axis=1) for rows in near], axis=0))
    shape = (len(shaded), tx_places.shape[1], rx_places.shape[1], len(grid_hz))
    out = np.ones(shape, dtype=np.complex64)
    some = paths.select(shaded)
    before, after, tx_turn, rx_turn = (line[shaded] for line in lines)
    tx = np.ascontiguousarray(tx_places[some.tx] - some.vertices[:, :1])
    rx = np.ascontiguousarray(rx_places[some.rx] - some.vertices[:, -1:])
    for outline, rows in zip(outlines, near, strict=True):
        _shade(
            some.vertices,
            rows[shaded],
            (before, after, tx_turn, rx_turn, relative[shaded]),
            (tx, rx),
            np.ascontiguousarray(outline.vertices.T, dtype=np.float64),
            (outline.mesh.faces, outline.mesh.edges, outline.mesh.sides),
            nodes_for(grid_hz),
            FRESNEL,
            mode == "hard",
            out,
        )
    return Passed(shaded, out, grid_hz)


def _places(xyz: np.ndarray, site: np.ndarray, port: np.ndarray) -> np.ndarray:
    """Positions of each site's elements [m], shape (site, place, 3)."""
    first = port == port.min()
    order = np.argsort(site[first], kind="stable")
    return xyz[first][order].reshape(site.max() + 1, -1, 3)


@numba.njit(cache=True, parallel=True)
def _shade(
    corners: np.ndarray,
    near: np.ndarray,
    lines: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    offsets: tuple[np.ndarray, np.ndarray],
    vertices: np.ndarray,
    mesh: tuple[np.ndarray, np.ndarray, np.ndarray],
    nodes: Nodes,
    table: np.ndarray,
    hard: bool,
    out: np.ndarray,
) -> None:
    """Multiplies the factors of one body into `out`."""
    before, after, tx_turn, rx_turn, relative = lines
    tx_offset, rx_offset = offsets
    band = nodes.hz[-1] - nodes.hz[len(nodes.hz) - out.shape[3]]
    for p in numba.prange(len(corners)):
        for i in range(corners.shape[1] - 1):
            if not near[p, i]:
                continue
            way = corners[p, i + 1] - corners[p, i]
            length = np.sqrt((way * way).sum())
            xy, plane, scale, axes = project(
                vertices, corners[p, i], corners[p, i + 1], before[p, i], after[p, i]
            )
            if scale == 0.0:
                continue
            per_m = np.sqrt(2.0 * scale * nodes.hz[-1] / SPEED_OF_LIGHT)
            within = reach(relative[p])
            # What weak paths do not hear of at all counts as unbounded, too.
            window = silhouette.WINDOW * min(1.0, within / FAR)
            pitch = silhouette.ROW / max(relative[p], 1e-6) / per_m
            runs, heights = silhouette.runs_of(xy, mesh, window / per_m, within / per_m, pitch)
            if not len(runs):
                continue
            if hard:
                if silhouette.covers(runs, heights):
                    out[p] = 0.0
                continue
            d_1, d_2 = before[p, i] + plane, after[p, i] + length - plane
            from_tx = _seen_offsets(axes, tx_turn[p, i], d_2 / (d_1 + d_2), tx_offset[p])
            from_rx = _seen_offsets(axes, rx_turn[p, i], d_1 / (d_1 + d_2), rx_offset[p])
            shifts = _shifts(from_tx, from_rx)
            # Seconds that the farthest edge answers later, by which its share turns.
            x_m, y_m, corner_m = silhouette.farthest(runs, heights, shifts)
            late = corner_m**2 * scale / (2.0 * SPEED_OF_LIGHT)
            rule = _rule_of(nodes.counts, np.pi * band * late)
            first = nodes.counts[:rule].sum()
            count = nodes.counts[rule]
            per_m_at = np.sqrt(2.0 * scale * nodes.hz[first : first + count] / SPEED_OF_LIGHT)
            change = _of_pairs(table, runs, heights, shifts, (x_m, y_m), per_m_at)
            _times(out[p], change, nodes.weights[first : first + count])


@numba.njit(cache=True)
def _of_pairs(
    table: np.ndarray,
    runs: np.ndarray,
    heights: np.ndarray,
    shifts: np.ndarray,
    farthest_m: tuple[float, float],
    per_m: np.ndarray,
) -> np.ndarray:
    """Factors less 1 at pairs of elements and frequencies, whichever way is less work.

    Returns:
        Real and imaginary, shape (2, frequency, pair).
    """
    pairs, count = shifts.shape[1], len(per_m)
    n_x = places_needed(0.5 * np.ptp(shifts[0]), farthest_m[0], per_m.max())
    n_y = places_needed(0.5 * np.ptp(shifts[1]), farthest_m[1], per_m.max())
    if max(n_x, n_y) <= MOST_PLACES and LOOK_UP * (2 * n_x + n_y) + n_x * n_y < LOOK_UP * 3 * pairs:
        return lattice_factors(runs, heights, shifts, (n_x, n_y), per_m)
    every, per_m_of = np.zeros((2, pairs * count)), np.zeros(pairs * count)
    for line in range(pairs * count):
        every[:, line] = shifts[:, line % pairs]
        per_m_of[line] = per_m[line // pairs]
    factors = screen_factors(table, runs, heights, every, per_m_of)
    change = np.zeros((2, count, pairs))
    for line in range(pairs * count):
        change[0, line // pairs, line % pairs] = factors[line].real - 1.0
        change[1, line // pairs, line % pairs] = factors[line].imag
    return change


@numba.njit(cache=True)
def _seen_offsets(
    axes: np.ndarray, turn: np.ndarray, scale: float, offset: np.ndarray
) -> np.ndarray:
    """Where elements of one end appear on the screen [m], shape (2, element).

    Args:
        axes: Axes of the screen, shape (2, 3).
        turn: Takes offsets to the segment, shape (3, 3).
        scale: How much of them is left at the screen.
        offset: Elements from their centre [m], shape (element, 3).
    """
    out = np.zeros((2, len(offset)))
    for axis in range(2):
        for j in range(3):
            part = axes[axis, 0] * turn[0, j] + axes[axis, 1] * turn[1, j]
            part = scale * (part + axes[axis, 2] * turn[2, j])
            for e in range(len(offset)):
                out[axis, e] += part * offset[e, j]
    return out


@numba.njit(cache=True)
def _shifts(from_tx: np.ndarray, from_rx: np.ndarray) -> np.ndarray:
    """Where the line of each pair of elements meets the screen [m], shape (2, tx * rx)."""
    n_tx, n_rx = from_tx.shape[1], from_rx.shape[1]
    shifts = np.zeros((2, n_tx * n_rx))
    for axis in range(2):
        for t in range(n_tx):
            for r in range(n_rx):
                shifts[axis, t * n_rx + r] = from_tx[axis, t] + from_rx[axis, r]
    return shifts


@numba.njit(cache=True)
def _rule_of(counts: np.ndarray, degree: float) -> int:
    """Which number of nodes tells a wave that turns by ± `degree` [rad] over the band.

    Its Chebyshev coefficients are Bessel functions J_n of the degree, 5e-4 or less from there on.
    """
    least = degree + np.cbrt(degree) + 1.0
    rule = 0
    while rule < len(counts) - 1 and counts[rule] < least:
        rule += 1
    return rule


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "nsz"})
def _times(out: np.ndarray, change: np.ndarray, weights: np.ndarray) -> None:
    """Multiplies factors into `out`, by the polynomials through them where there are any.

    Args:
        out: Changed, complex64, shape (tx, rx, grid).
        change: Factors less 1, real and imaginary, shape (2, node, tx · rx).
        weights: What the grid takes of each node, shape (node, grid); none where the nodes are
            the grid.
    """
    n_tx, n_rx, grid = out.shape
    real, imaginary = np.zeros(grid), np.zeros(grid)
    for e in range(n_tx * n_rx):
        row = out[e // n_rx, e % n_rx]
        if len(weights):
            real[:] = 1.0
            imaginary[:] = 0.0
        for n in range(len(weights)):
            part, re, im = weights[n], change[0, n, e], change[1, n, e]
            for g in range(grid):
                real[g] += part[g] * re
                imaginary[g] += part[g] * im
        for g in range(grid if not len(weights) else 0):
            real[g], imaginary[g] = 1.0 + change[0, g, e], change[1, g, e]
        for g in range(grid):
            row[g] *= complex(real[g], imaginary[g])
