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
from rfgs_core.simulate.shadow.unfold import unfold

Shadow = Literal["kirchhoff", "hard"]


@dataclass(frozen=True)
class Outline:
    """What casts a shadow, and on what."""

    vertices: np.ndarray
    """Vertices [m], shape (V, 3)."""
    faces: np.ndarray
    """Triangles, shape (T, 3)."""
    beside: np.ndarray
    """Which segments of the paths it may shade, bool, shape (path, segment)."""


@dataclass(frozen=True)
class Passed:
    """What is left of the paths that something shades; all others pass as they are."""

    path: np.ndarray
    """Which paths, ascending, int64, shape (shaded,)."""
    factor: np.ndarray
    """Factor on the amplitude, complex128, shape (shaded, tx place of the site, rx place of the
    site, grid); ports of one element share a place."""
    grid_hz: np.ndarray
    """Frequencies of the factors [Hz], shape (grid,); linear in between."""


#: Detail of the mesh that casts shadows [m]; far below the first Fresnel zone of any preset.
DETAIL_M = 0.015
#: Shadows that change a device pair by less than this share of its strongest path are left out.
NEGLIGIBLE = 1e-3


def coarse_mesh(
    vertices: np.ndarray, faces: np.ndarray, detail_m: float = DETAIL_M
) -> tuple[np.ndarray, np.ndarray]:
    """Thins out a mesh for its silhouette by joining vertices within cells.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        detail_m: Size of the cells [m].

    Returns:
        Indices of the vertices that are kept and triangles over them.
    """
    used = np.unique(faces)
    cells = np.floor(vertices[used].astype(np.float64) / detail_m).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.ravel()
    size = np.bincount(cell)
    mean = np.stack([np.bincount(cell, vertices[used, i]) / size for i in range(3)], axis=1)
    away = np.linalg.norm(vertices[used] - mean[cell], axis=1)
    order = np.lexsort((away, cell))
    kept = used[order[np.unique(cell[order], return_index=True)[1]]]
    of_vertex = np.zeros(len(vertices), dtype=np.int64)
    of_vertex[used] = cell
    thin = of_vertex[faces]
    flat = (thin[:, 0] == thin[:, 1]) | (thin[:, 1] == thin[:, 2]) | (thin[:, 2] == thin[:, 0])
    thin = thin[~flat]
    _, first = np.unique(np.sort(thin, axis=1), axis=0, return_index=True)
    return kept, thin[np.sort(first)]


def _relative(paths: PathSet) -> np.ndarray:
    """Amplitude of each path relative to the strongest of its pair of sites, shape (path,)."""
    strength = np.abs(paths.amplitude).max(axis=(1, 2))
    pair = paths.tx * (int(paths.rx.max(initial=0)) + 1) + paths.rx
    strongest = np.zeros(int(pair.max(initial=0)) + 1)
    np.maximum.at(strongest, pair, strength)
    return strength / np.maximum(strongest[pair], 1e-300)


@numba.njit(cache=True)
def _reach(relative: float) -> float:
    """Fresnel coordinate up to which a shadow on a path of some relative amplitude matters.

    At ν from its edge a screen changes a path by about 1/(√2 π ν) of its amplitude.
    """
    return min(relative / (np.sqrt(2.0) * np.pi * NEGLIGIBLE), silhouette.FAR)


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
    lines, relative = unfold(paths), _relative(paths)
    near = [
        outline.beside
        & _near(
            paths.vertices, lines[0], lines[1], relative, *_ball(outline.vertices), grid_hz.max()
        )
        for outline in outlines
    ]
    shaded = np.flatnonzero(np.any([rows.any(axis=1) for rows in near], axis=0))
    shape = (len(shaded), tx_places.shape[1], rx_places.shape[1], len(grid_hz))
    out = np.ones(shape, dtype=np.complex128)
    some = paths.select(shaded)
    tx = np.ascontiguousarray(tx_places[some.tx] - some.vertices[:, :1])
    rx = np.ascontiguousarray(rx_places[some.rx] - some.vertices[:, -1:])
    for outline, rows in zip(outlines, near, strict=True):
        _shade(
            some.vertices,
            rows[shaded],
            (
                lines[0][shaded],
                lines[1][shaded],
                lines[2][shaded],
                lines[3][shaded],
                relative[shaded],
            ),
            (tx, rx),
            np.ascontiguousarray(outline.vertices, dtype=np.float64),
            np.ascontiguousarray(outline.faces, dtype=np.int64),
            nodes_for(grid_hz),
            silhouette.FRESNEL,
            mode == "hard",
            out,
        )
    return Passed(shaded, out, grid_hz)


def near_segments(paths: PathSet, vertices: np.ndarray, highest_hz: float) -> np.ndarray:
    """Which segments of paths a body may shade, walls or not, bool, shape (path, segment).

    Args:
        paths: Environment paths.
        vertices: Vertices of the body [m], shape (V, 3).
        highest_hz: Highest frequency [Hz].
    """
    before, after, _, _ = unfold(paths)
    ball = _ball(vertices)
    return _near(paths.vertices, before, after, _relative(paths), *ball, highest_hz)


def _places(xyz: np.ndarray, site: np.ndarray, port: np.ndarray) -> np.ndarray:
    """Positions of each site's elements [m], shape (site, place, 3)."""
    first = port == port.min()
    order = np.argsort(site[first], kind="stable")
    return xyz[first][order].reshape(site.max() + 1, -1, 3)


def _ball(vertices: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and radius of a ball around a body [m]."""
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)).astype(np.float64)
    return centre, float(np.linalg.norm(vertices - centre, axis=1).max())


@numba.njit(cache=True)
def _near(
    corners: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    relative: np.ndarray,
    centre: np.ndarray,
    radius: float,
    freq_hz: float,
) -> np.ndarray:
    """Which segments a ball may come nearer to than the reach, bool, shape (path, segment).

    Fresnel coordinates grow towards the ends of the unfolded line: what counts is their scale
    where the ball is nearest to its middle.
    """
    near = np.zeros(before.shape, dtype=np.bool_)
    for p in range(near.shape[0]):
        for i in range(near.shape[1]):
            way = corners[p, i + 1] - corners[p, i]
            to = centre - corners[p, i]
            length = np.sqrt((way * way).sum())
            if length < 1e-6:
                continue
            depth = (to * way).sum() / length
            low, high = max(depth - radius, 0.0), min(depth + radius, length)
            if low >= high:
                continue
            beside = np.sqrt(max((to * to).sum() - depth * depth, 0.0)) - radius
            whole = before[p, i] + length + after[p, i]
            at = min(max(0.5 * whole, before[p, i] + low), before[p, i] + high)
            per_m = np.sqrt(2.0 * (1.0 / at + 1.0 / (whole - at)) * freq_hz / SPEED_OF_LIGHT)
            near[p, i] = beside * per_m <= _reach(relative[p])
    return near


@numba.njit(cache=True, parallel=True)
def _shade(
    corners: np.ndarray,
    near: np.ndarray,
    lines: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    offsets: tuple[np.ndarray, np.ndarray],
    vertices: np.ndarray,
    faces: np.ndarray,
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
            xy, between, plane, scale, axes = silhouette.project(
                vertices, corners[p, i], corners[p, i + 1], before[p, i], after[p, i]
            )
            if scale == 0.0:
                continue
            per_m = np.sqrt(2.0 * scale * nodes.hz[-1] / SPEED_OF_LIGHT)
            reach = _reach(relative[p])
            window = min(silhouette.WINDOW, silhouette.WINDOW_PER_REACH * reach)
            pitch = silhouette.ROW / max(relative[p], 1e-6) / per_m
            runs, heights = silhouette.runs_of(
                xy, between, faces, window / per_m, reach / per_m, pitch
            )
            if not len(runs):
                continue
            if hard:
                if silhouette.covers(runs, heights):
                    out[p] = 0.0
                continue
            d_1, d_2 = before[p, i] + plane, after[p, i] + length - plane
            to_tx = (axes @ tx_turn[p, i]) * (d_2 / (d_1 + d_2))
            to_rx = (axes @ rx_turn[p, i]) * (d_1 / (d_1 + d_2))
            shifts = _shifts(to_tx, to_rx, tx_offset[p], rx_offset[p])
            # Seconds that the farthest edge answers later, by which its share turns.
            late = silhouette.farthest(runs, heights, shifts) ** 2 * scale / (2.0 * SPEED_OF_LIGHT)
            choice = _choice(nodes.counts, np.pi * band * late)
            first = nodes.counts[:choice].sum()
            count = nodes.counts[choice]
            every = np.zeros((2, shifts.shape[1] * count))
            per_m_of = np.zeros(every.shape[1])
            for line in range(every.shape[1]):
                every[:, line] = shifts[:, line // count]
                wave = nodes.hz[first + line % count] / SPEED_OF_LIGHT
                per_m_of[line] = np.sqrt(2.0 * scale * wave)
            flat = silhouette.screen_factors(table, runs, heights, every, per_m_of)
            weights, n_rx = nodes.weights[first : first + count], rx_offset.shape[1]
            for e in range(shifts.shape[1]):
                factors = flat[e * count : (e + 1) * count]
                _times(out[p, e // n_rx, e % n_rx], factors, weights)


@numba.njit(cache=True)
def _shifts(
    to_tx: np.ndarray, to_rx: np.ndarray, tx_offset: np.ndarray, rx_offset: np.ndarray
) -> np.ndarray:
    """Where the line of each pair of elements meets the screen [m], shape (2, tx * rx)."""
    n_rx = len(rx_offset)
    shifts = np.zeros((2, len(tx_offset) * n_rx))
    for e in range(shifts.shape[1]):
        for axis in range(2):
            shifts[axis, e] = (to_tx[axis] * tx_offset[e // n_rx]).sum()
            shifts[axis, e] += (to_rx[axis] * rx_offset[e % n_rx]).sum()
    return shifts


@numba.njit(cache=True)
def _choice(counts: np.ndarray, degree: float) -> int:
    """Which number of nodes tells a wave that turns by ± `degree` [rad] over the band.

    Its Chebyshev coefficients are Bessel functions J_n of the degree, 5e-4 or less from there on.
    """
    least = degree + 1.5 * np.cbrt(degree) + 3.0
    choice = 0
    while choice < len(counts) - 1 and counts[choice] < least:
        choice += 1
    return choice


@numba.njit(cache=True)
def _times(out: np.ndarray, factors: np.ndarray, weights: np.ndarray) -> None:
    """Multiplies into `out` the polynomial through some factors, or these where it has none."""
    if not len(weights):
        for g in range(len(out)):
            out[g] *= factors[g]
        return
    real, imaginary = np.zeros(len(out)), np.zeros(len(out))
    for n in range(len(factors)):
        row, re, im = weights[n], factors[n].real, factors[n].imag
        for g in range(len(row)):
            real[g] += row[g] * re
            imaginary[g] += row[g] * im
    for g in range(len(out)):
        out[g] *= complex(real[g], imaginary[g])
