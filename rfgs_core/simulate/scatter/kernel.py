# SPDX-License-Identifier: Apache-2.0
"""Spreads facets over the delay grids of all links to one array.

The facet is that of `rfgs_core.simulate.surface.facets`. Polarisation, walls and what hides a
facet are taken at the centres of the arrays and come as fields; phases are exact for every
element. So are amplitudes where the way is straight at both ends; by way of a wall they are those
of the centres. Links lie side by side in single precision, so that the inner loops become vector
code; what single precision could not tell, the whole way between the centres, is kept in double.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.simulate.scatter.elements import (
    MOST_DAMPED,
    centre_values,
    exact_values,
    see_elements,
    spread_values,
)
from rfgs_core.simulate.scatter.grid import BETA, WIDTH


class Patches(NamedTuple):
    """Facets of one body as they scatter."""

    points: np.ndarray
    """Positions [m], shape (facet, 3)."""
    normals: np.ndarray
    """Unit normals, shape (facet, 3)."""
    areas: np.ndarray
    """Areas [m²], shape (facet,)."""
    gamma: np.ndarray
    """Reflection coefficient of each material, complex64, shape (material, node)."""
    material: np.ndarray
    """Material of each, shape (facet,)."""


class Arrays(NamedTuple):
    """Transmitting arrays, or their images, and the receiving one."""

    tx_centre: np.ndarray
    """Centres [m], shape (way, 3)."""
    tx_offset: np.ndarray
    """Elements from there, as `see_elements` takes them, shape (way, 4, element)."""
    rx_centre: np.ndarray
    """Centre of the receiving array [m], shape (3,)."""
    rx_offset: np.ndarray
    """Its elements, shape (4, element)."""
    size_m: float
    """Size of two arrays together [m]."""


@numba.njit(cache=True, nogil=True)
def seen_from_centres(
    to_tx: tuple[float, float, float],
    to_rx: tuple[float, float, float],
    n: tuple[float, float, float],
    damping: float,
    spread: float,
) -> bool:
    """Whether any pair of elements of two arrays may see a facet, judged from their centres.

    Args:
        to_tx: Unit vector to the centre of the transmitting array.
        to_rx: That to the receiving one.
        n: Normal.
        damping: k² A / 24 at the lowest frequency.
        spread: Largest angle by which elements may see it otherwise [rad].
    """
    c_t = to_tx[0] * n[0] + to_tx[1] * n[1] + to_tx[2] * n[2]
    c_r = to_rx[0] * n[0] + to_rx[1] * n[1] + to_rx[2] * n[2]
    if c_t < -spread or c_r < -spread:
        return False
    qx, qy, qz = to_tx[0] + to_rx[0], to_tx[1] + to_rx[1], to_tx[2] + to_rx[2]
    q_t2 = qx * qx + qy * qy + qz * qz - (c_t + c_r) ** 2
    if damping * q_t2 < MOST_DAMPED:
        return True
    q_t = max(math.sqrt(max(q_t2, 0.0)) - 2.0 * spread, 0.0)
    return damping * q_t * q_t < MOST_DAMPED


@numba.njit(cache=True, nogil=True)
def _window(place: float, kernel: np.ndarray) -> int:
    """Fills in the window around a place among the cells; returns the first of them."""
    first = math.ceil(place - 0.5 * WIDTH)
    for c in range(WIDTH):
        x = (first + c - place) / (0.5 * WIDTH)
        kernel[c] = math.exp(BETA * (math.sqrt(max(1.0 - x * x, 0.0)) - 1.0))
    return first


@numba.njit(cache=True, nogil=True)
def _weights(
    a: np.ndarray,
    b: np.ndarray,
    gamma: np.ndarray,
    length_m: float,
    centre_k: float,
    area: float,
    out: np.ndarray,
) -> None:
    """Fills in what all links of a facet have in common at each node, complex128, (node,).

    Args:
        a: θ and φ of what reaches it from the transmitter, shape (2, node).
        b: The same from the receiver.
        gamma: Its reflection coefficient, shape (node,).
        length_m: Length of the way between the centres of the arrays [m].
        centre_k: Middle wavenumber [rad/m].
        area: Its area [m²].
        out: Filled.
    """
    angle = -centre_k * length_m
    # Kirchhoff's phase is a quarter turn.
    common = complex(-math.sin(angle), math.cos(angle)) * (area / (8.0 * math.pi))
    for m in range(len(out)):
        # Facets hand θ and φ on; seen from the other end φ points the other way.
        out[m] = common * gamma[m] * (a[0, m] * b[0, m] - a[1, m] * b[1, m])


@numba.njit(cache=True, nogil=True)
def _damp(
    to_tx: tuple[float, float, float],
    to_rx: tuple[float, float, float],
    n: tuple[float, float, float],
    size: tuple[float, float],
    node_k: np.ndarray,
    weight: np.ndarray,
) -> None:
    """Multiplies weights by the amplitude at the centres, but for the way to the receiver.

    Args:
        to_tx: Unit vector to the centre of the transmitting array.
        to_rx: That to the receiving one.
        n: Normal.
        size: Area / 24 [m²] and the length of the way to the transmitter [m].
        node_k: Wavenumbers of the nodes [rad/m].
        weight: Changed, shape (node,).
    """
    c = to_tx[0] * n[0] + to_tx[1] * n[1] + to_tx[2] * n[2]
    c += to_rx[0] * n[0] + to_rx[1] * n[1] + to_rx[2] * n[2]
    qx, qy, qz = to_tx[0] + to_rx[0], to_tx[1] + to_rx[1], to_tx[2] + to_rx[2]
    q_t2 = max(qx * qx + qy * qy + qz * qz - c * c, 0.0)
    for m in range(len(weight)):
        weight[m] *= c * math.exp(-size[0] * q_t2 * node_k[m] * node_k[m]) / size[1]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def spread_facets(
    patches: Patches,
    used: np.ndarray,
    from_rx: np.ndarray,
    from_tx: tuple[np.ndarray, np.ndarray, np.ndarray],
    arrays: Arrays,
    grid: tuple[float, float, np.ndarray],
    exact: np.ndarray,
    onto: np.ndarray,
    out: np.ndarray,
) -> None:
    """Adds facets between one array and several others to the grids of their links.

    Args:
        patches: The facets.
        used: Facets that the receiving array hears, int64.
        from_rx: θ and φ of what reaches each facet from it, complex64, shape (facet, 2, node).
        from_tx: The same of all transmitting arrays, shape (way, facet, 2, node), where each of
            them reaches, bool, shape (way, facet), and which of them to take.
        arrays: The arrays.
        grid: Path length of a cell [m], middle wavenumber and those of the nodes [rad/m].
        exact: Whether amplitudes of a way are those of each pair of elements, shape (way,).
        onto: Grid that each transmitting array adds to, shape (way,).
        out: Real and imaginary part at each node, cell and link, float32, shape
            (grid, node, 2, cell, tx · rx).
    """
    tx_fields, reaches, ways = from_tx
    cell_m, centre_k, node_k = grid
    nodes, n_tx, n_rx = len(node_k), arrays.tx_offset.shape[2], arrays.rx_offset.shape[1]
    turns = np.concatenate((np.array([centre_k]), node_k - centre_k)) / (2.0 * math.pi)
    tx_seen, sent = _room_for(n_tx, nodes)
    rx_seen, heard = _room_for(n_rx, nodes)
    values = np.zeros((2, n_tx * n_rx), dtype=np.float32)
    kernel, weight = np.zeros(WIDTH, dtype=np.float32), np.zeros(nodes, dtype=np.complex128)
    for i in used:
        b, area, scale = from_rx[i], patches.areas[i], patches.areas[i] / 24.0
        n = patches.normals[i, 0], patches.normals[i, 1], patches.normals[i, 2]
        to_rx, d_r = _towards(patches.points[i], arrays.rx_centre)
        ready = False
        for w in ways:
            if not reaches[w, i]:
                continue
            to_tx, d_t = _towards(patches.points[i], arrays.tx_centre[w])
            spread = arrays.size_m / min(d_t, d_r)
            if not seen_from_centres(to_tx, to_rx, n, scale * node_k[0] ** 2, spread):
                continue
            if not ready:
                see_elements(to_rx, d_r, n, arrays.rx_offset, turns, rx_seen, heard)
                ready = True
            see_elements(to_tx, d_t, n, arrays.tx_offset[w], turns, tx_seen, sent)
            first = _window((d_t + d_r) / cell_m, kernel)
            gamma = patches.gamma[patches.material[i]]
            _weights(tx_fields[w, i], b, gamma, d_t + d_r, centre_k, area, weight)
            if not exact[w]:
                _damp(to_tx, to_rx, n, (scale, d_t), node_k, weight)
            seen, fields, damping = (tx_seen, rx_seen), (sent, heard), scale * node_k**2
            for m in range(nodes):
                _values_at(m, seen, fields, weight[m], damping[m], exact[w], values)
                spread_values(values, kernel, first, out[onto[w], m])


@numba.njit(cache=True, nogil=True, inline="always")
def _values_at(
    m: int,
    seen: tuple[np.ndarray, np.ndarray],
    fields: tuple[np.ndarray, np.ndarray],
    weight: complex,
    damping: float,
    exact: bool,
    values: np.ndarray,
) -> None:
    """Fills in what a facet adds to every link at node m, see `exact_values`."""
    if exact:
        exact_values(seen[0], seen[1], fields[0][m], fields[1][m], weight, damping, values)
    else:
        centre_values(seen[1], fields[0][m], fields[1][m], weight, values)


@numba.njit(cache=True, nogil=True)
def _room_for(elements: int, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """What `see_elements` fills in for an array."""
    seen = np.zeros((8, elements), dtype=np.float32)
    return seen, np.zeros((nodes, 2, elements), dtype=np.float32)


@numba.njit(cache=True, nogil=True)
def _towards(p: np.ndarray, place: np.ndarray) -> tuple[tuple[float, float, float], float]:
    """Unit vector from a point to a place, and their distance [m]."""
    x, y, z = place[0] - p[0], place[1] - p[1], place[2] - p[2]
    d = math.sqrt(x * x + y * y + z * z)
    return (x / d, y / d, z / d), d
