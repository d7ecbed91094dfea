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

from dataset_factory.trace import silhouette
from dataset_factory.trace.paths import PathSet
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT

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


#: Detail of the mesh that casts shadows [m]; far below the first Fresnel zone of any preset.
DETAIL_M = 0.015
#: Shadows that change a device pair by less than this share of its strongest path are left out.
NEGLIGIBLE = 1e-3


def coarse_mesh(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Thins out a mesh for its silhouette by joining vertices within cells of `DETAIL_M`.

    Args:
        vertices: Rest pose [m], shape (V, 3).
        faces: Triangles, shape (T, 3).

    Returns:
        Indices of the vertices that are kept and triangles over them.
    """
    used = np.unique(faces)
    cells = np.floor(vertices[used].astype(np.float64) / DETAIL_M).astype(np.int64)
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


def _reach(paths: PathSet) -> np.ndarray:
    """Fresnel coordinate up to which a shadow on each path matters, shape (path,).

    At ν from its edge a screen changes a path by about 1/(√2 π ν) of its amplitude.
    """
    strength = np.abs(paths.amplitude).max(axis=(1, 2))
    pair = paths.tx * (int(paths.rx.max()) + 1) + paths.rx
    strongest = np.zeros(int(pair.max()) + 1)
    np.maximum.at(strongest, pair, strength)
    relative = strength / np.maximum(strongest[pair], 1e-300)
    return np.minimum(relative / (np.sqrt(2.0) * np.pi * NEGLIGIBLE), silhouette.FAR)


def transmission(
    paths: PathSet,
    layout: Layout,
    outlines: list[Outline],
    nodes_hz: np.ndarray,
    mode: Shadow,
) -> np.ndarray:
    """Shadow factors of every path.

    Args:
        paths: Environment paths.
        layout: Antenna elements; every site has equally many.
        outlines: Everybody's, for these paths.
        nodes_hz: Frequencies of the factors [Hz], shape (node,).
        mode: "kirchhoff", or "hard" for all or nothing.

    Returns:
        Complex128, shape (path, tx place of the site, rx place of the site, node); ports of one
        element share a place.
    """
    tx_places = _places(layout.tx_xyz, layout.tx_site, layout.tx_port)
    rx_places = _places(layout.rx_xyz, layout.rx_site, layout.rx_port)
    shape = (len(paths), tx_places.shape[1], rx_places.shape[1], len(nodes_hz))
    out = np.ones(shape, dtype=np.complex128)
    if not len(paths):
        return out
    unfolded = _unfold(paths)
    tx = tx_places[paths.tx] - paths.vertices[:, :1]
    rx = rx_places[paths.rx] - paths.vertices[:, -1:]
    for outline in outlines:
        _shade(
            paths.vertices,
            outline.beside,
            (*unfolded, _reach(paths)),
            np.ascontiguousarray(tx),
            np.ascontiguousarray(rx),
            np.ascontiguousarray(outline.vertices, dtype=np.float64),
            np.ascontiguousarray(outline.faces, dtype=np.int64),
            SPEED_OF_LIGHT / np.asarray(nodes_hz, dtype=np.float64),
            silhouette.FRESNEL,
            mode == "hard",
            out,
        )
    return out


def _places(xyz: np.ndarray, site: np.ndarray, port: np.ndarray) -> np.ndarray:
    """Positions of each site's elements [m], shape (site, place, 3)."""
    first = port == port.min()
    order = np.argsort(site[first], kind="stable")
    return xyz[first][order].reshape(site.max() + 1, -1, 3)


def _unfold(paths: PathSet) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where each segment lies on its unfolded line, and how offsets of the ends appear there.

    A scattering point starts a new line: beyond it the transmitter's elements are one point.

    Returns:
        Length before and after each segment [m], shape (path, depth + 1), and matrices that
        take offsets of TX and RX elements to the segment, shape (path, depth + 1, 3, 3).
    """
    steps = np.diff(paths.vertices, axis=1)
    length = np.linalg.norm(steps, axis=2)
    k = steps / np.maximum(length, 1e-12)[:, :, None]
    count, segments = length.shape
    before, after = np.zeros((count, segments)), np.zeros((count, segments))
    tx_turn = np.broadcast_to(np.eye(3), (count, segments, 3, 3)).copy()
    rx_turn = tx_turn.copy()
    breaks = paths.breaks()
    reflect = _reflections(paths, k)
    for i in range(segments - 1):
        broken = breaks[:, i]
        before[:, i + 1] = np.where(broken, 0.0, before[:, i] + length[:, i])
        turned = reflect[:, i] @ tx_turn[:, i]
        tx_turn[:, i + 1] = np.where(broken[:, None, None], 0.0, turned)
    for i in range(segments - 2, -1, -1):
        broken = breaks[:, i]
        after[:, i] = np.where(broken, 0.0, after[:, i + 1] + length[:, i + 1])
        turned = reflect[:, i] @ rx_turn[:, i + 1]
        rx_turn[:, i] = np.where(broken[:, None, None], 0.0, turned)
    return before, after, tx_turn, rx_turn


def _reflections(paths: PathSet, k: np.ndarray) -> np.ndarray:
    """Mirror matrix of each interaction, the identity where nothing bends (path, depth, 3, 3)."""
    normal = k[:, 1:] - k[:, :-1]
    size = np.linalg.norm(normal, axis=2)
    bends = paths.mirrors() & (size > 1e-9)
    normal = np.where(bends[:, :, None], normal / np.maximum(size, 1e-12)[:, :, None], 0.0)
    return np.eye(3) - 2.0 * normal[..., :, None] * normal[..., None, :]


@numba.njit(cache=True, parallel=True)
def _shade(
    corners: np.ndarray,
    beside: np.ndarray,
    unfolded: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    tx_offset: np.ndarray,
    rx_offset: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    wavelengths: np.ndarray,
    table: np.ndarray,
    hard: bool,
    out: np.ndarray,
) -> None:
    """Multiplies the factors of one body into `out`."""
    before, after, tx_turn, rx_turn, reach = unfolded
    shortest = wavelengths.min()
    for p in numba.prange(len(corners)):
        for i in range(corners.shape[1] - 1):
            way = corners[p, i + 1] - corners[p, i]
            length = np.sqrt((way * way).sum())
            if length < 1e-6 or not beside[p, i]:
                continue
            xy, between, plane, scale, axes = silhouette.project(
                vertices, corners[p, i], corners[p, i + 1], before[p, i], after[p, i]
            )
            if scale == 0.0:
                continue
            per_m = np.sqrt(2.0 * scale / shortest)
            runs, heights = silhouette.runs_of(
                xy, between, faces, silhouette.WINDOW / per_m, reach[p] / per_m
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
            n_rx = rx_offset.shape[1]
            shifts = np.zeros((2, tx_offset.shape[1] * n_rx))
            for e in range(shifts.shape[1]):
                t, r = e // n_rx, e % n_rx
                for axis in range(2):
                    shifts[axis, e] = (to_tx[axis] * tx_offset[p, t]).sum()
                    shifts[axis, e] += (to_rx[axis] * rx_offset[p, r]).sum()
            for n in range(len(wavelengths)):
                per_m = np.sqrt(2.0 * scale / wavelengths[n])
                factors = silhouette.screen_factors(table, runs, heights, shifts, per_m)
                for e in range(len(factors)):
                    out[p, e // n_rx, e % n_rx, n] *= factors[e]
