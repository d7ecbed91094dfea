# SPDX-License-Identifier: Apache-2.0
"""Spreads facets over the delay grid of every link between two arrays.

The facet is that of `rfgs_core.simulate.surface.facets`, exact for every pair of elements; only
its polarisation, its walls and what hides it are taken at the centres of the arrays, and come as
weights. Lengths are in double precision up to the whole turns of the phase, the rest in single:
links lie side by side, so that the inner loops become vector code.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from rfgs_core.simulate.scatter.grid import WIDTH

#: Facets damped by more than e^-12 are 100 dB weaker than they could be and are left out.
_MOST_DAMPED = 12.0
#: Adding and taking away this rounds a double to whole numbers.
_ROUND = 6755399441055744.0


@numba.njit(cache=True, nogil=True, fastmath={"contract", "nsz", "ninf", "nnan"})
def _elements(
    p: np.ndarray,
    n: np.ndarray,
    xyz: np.ndarray,
    centre_m: float,
    turns: np.ndarray,
    ways: np.ndarray,
    phasor: np.ndarray,
) -> None:
    """What one facet sees of an array.

    Args:
        p: Facet [m], shape (3,).
        n: Its normal, shape (3,).
        xyz: Elements [m], shape (3, element).
        centre_m: Distance of the facet from the centre of the array [m].
        turns: Turns per metre at the middle subcarrier, and at each node beyond that, (1 + node,).
        ways: Filled with unit vectors to the elements, their part along the normal and one over
            the distances, float32, shape (5, element).
        phasor: Filled with e^{−jkd}, the centre's turns beyond the middle subcarrier left to the
            grid, real and imaginary, float32, shape (node, 2, element).
    """
    x, y, z = p[0], p[1], p[2]
    nx, ny, nz = n[0], n[1], n[2]
    xs, ys, zs = xyz[0], xyz[1], xyz[2]
    w0, w1, w2, w3, w4 = ways[0], ways[1], ways[2], ways[3], ways[4]
    for e in range(len(xs)):
        dx, dy, dz = xs[e] - x, ys[e] - y, zs[e] - z
        d = math.sqrt(dx * dx + dy * dy + dz * dz)
        inverse = 1.0 / d
        w0[e], w1[e], w2[e] = dx * inverse, dy * inverse, dz * inverse
        w3[e] = (dx * nx + dy * ny + dz * nz) * inverse
        w4[e] = inverse
    for m in range(len(phasor)):
        re, im = phasor[m, 0], phasor[m, 1]
        per_m, beyond = turns[0] + turns[1 + m], turns[1 + m] * centre_m
        for e in range(len(xs)):
            dx, dy, dz = xs[e] - x, ys[e] - y, zs[e] - z
            d = math.sqrt(dx * dx + dy * dy + dz * dz)
            turn = per_m * d - beyond
            whole = (turn + _ROUND) - _ROUND
            f = np.float32(turn - whole)
            # sin and cos of 2πf for −½ ≤ f ≤ ½, from those of πf: errors below 4e-6.
            a = np.float32(3.14159265) * f
            b = a * a
            s = a * (
                np.float32(0.9999999995)
                + b
                * (
                    np.float32(-0.16666666)
                    + b
                    * (
                        np.float32(8.3333310e-3)
                        + b * (np.float32(-1.9840874e-4) + b * np.float32(2.7525562e-6))
                    )
                )
            )
            c = np.float32(1.0) + b * (
                np.float32(-0.5)
                + b
                * (
                    np.float32(4.1666638e-2)
                    + b
                    * (
                        np.float32(-1.3888378e-3)
                        + b * (np.float32(2.4760495e-5) + b * np.float32(-2.6051615e-7))
                    )
                )
            )
            re[e] = np.float32(1.0) - np.float32(2.0) * s * s
            im[e] = np.float32(-2.0) * s * c


@numba.njit(cache=True, nogil=True, fastmath={"contract", "nsz", "ninf", "nnan"})
def _amplitudes(
    tx: np.ndarray, t: int, rx: np.ndarray, damping: np.ndarray, out: np.ndarray
) -> None:
    """Real amplitude of one facet between an element and all of an array, per node.

    Args:
        tx: Ways to the transmitting elements, see `_elements`.
        t: Which of them.
        rx: Ways to the receiving elements.
        damping: k² A / 24 at each node, float32, shape (node,).
        out: Filled, float32, shape (node, rx).
    """
    x, y, z, along, near = tx[0, t], tx[1, t], tx[2, t], tx[3, t], tx[4, t]
    r0, r1, r2, r3, r4 = rx[0], rx[1], rx[2], rx[3], rx[4]
    for m in range(len(damping)):
        row, factor = out[m], damping[m]
        for r in range(len(r0)):
            c = along + r3[r]
            q_t2 = np.float32(2.0) + np.float32(2.0) * (x * r0[r] + y * r1[r] + z * r2[r]) - c * c
            e = factor * max(q_t2, np.float32(0.0))
            lit = (r3[r] > np.float32(0.0)) & (e < np.float32(_MOST_DAMPED))
            # e^−e = (e^−e/16)^16, the inner one by its series.
            y_ = min(e, np.float32(_MOST_DAMPED)) * np.float32(-1.0 / 16.0)
            s = np.float32(1.0) + y_ * (
                np.float32(1.0)
                + y_
                * (
                    np.float32(0.5)
                    + y_
                    * (
                        np.float32(1.0 / 6.0)
                        + y_ * (np.float32(1.0 / 24.0) + y_ * np.float32(1.0 / 120.0))
                    )
                )
            )
            s = s * s
            s = s * s
            s = s * s
            s = s * s
            value = c * near * r4[r] * s
            row[r] = value if lit else np.float32(0.0)


@numba.njit(cache=True, nogil=True, fastmath={"contract", "nsz", "ninf", "nnan"})
def _add(
    amplitude: np.ndarray,
    sent_re: float,
    sent_im: float,
    heard: np.ndarray,
    kernel: np.ndarray,
    first: int,
    lanes: int,
    out: np.ndarray,
) -> None:
    """Adds one facet, element and node to the cells of its delay.

    Args:
        amplitude: Real amplitude per receiving element, shape (rx,).
        sent_re: Real part of weight times phasor of the transmitting element.
        sent_im: Imaginary part.
        heard: Phasors of the receiving elements, shape (2, rx).
        kernel: The window over the cells, shape (`WIDTH`,).
        first: First cell.
        lanes: First of the links.
        out: The grid of a node, float32, shape (2, cell, link).
    """
    h_re, h_im = heard[0], heard[1]
    cells = out.shape[1]
    re = np.zeros(len(h_re), dtype=np.float32)
    im = np.zeros(len(h_re), dtype=np.float32)
    for r in range(len(h_re)):
        re[r] = amplitude[r] * (sent_re * h_re[r] - sent_im * h_im[r])
        im[r] = amplitude[r] * (sent_re * h_im[r] + sent_im * h_re[r])
    for w in range(WIDTH):
        cell = (first + w) % cells
        row_re, row_im, k = out[0, cell], out[1, cell], kernel[w]
        for r in range(len(h_re)):
            row_re[lanes + r] += k * re[r]
            row_im[lanes + r] += k * im[r]


@numba.njit(cache=True, nogil=True)
def _norm(v: np.ndarray) -> float:
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@numba.njit(cache=True, nogil=True)
def _size(xyz: np.ndarray, centre: np.ndarray) -> float:
    """Largest distance of elements, shape (3, element), from the centre of their array [m]."""
    largest = 0.0
    for e in range(xyz.shape[1]):
        largest = max(largest, _norm(xyz[:, e] - centre))
    return largest


@numba.njit(cache=True, nogil=True)
def _misses(
    to_tx: np.ndarray, to_rx: np.ndarray, n: np.ndarray, damping: float, spread: float
) -> bool:
    """Whether no pair of elements sees a facet, judged from the centres of their arrays.

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
        return True
    qx, qy, qz = to_tx[0] + to_rx[0], to_tx[1] + to_rx[1], to_tx[2] + to_rx[2]
    q_t2 = qx * qx + qy * qy + qz * qz - (c_t + c_r) ** 2
    q_t = max(math.sqrt(max(q_t2, 0.0)) - 2.0 * spread, 0.0)
    return damping * q_t * q_t > _MOST_DAMPED


@numba.njit(cache=True, nogil=True, error_model="numpy")
def spread_facets(
    points: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    fields: tuple[np.ndarray, np.ndarray],
    gamma: np.ndarray,
    material: np.ndarray,
    ends: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    grid: tuple[float, float, np.ndarray],
    beta: float,
    out: np.ndarray,
) -> None:
    """Adds facets between two arrays to the grid of their links.

    Args:
        points: Positions [m], shape (facet, 3).
        normals: Unit normals, shape (facet, 3).
        areas: Areas [m²], shape (facet,).
        fields: θ and φ of what reaches each facet from both ends, 0 where it is hidden, each
            complex64, shape (facet, 2, node).
        gamma: Reflection coefficient of each material, complex64, shape (material, node).
        material: Material of each facet, shape (facet,).
        ends: Transmitting and receiving elements [m], each of shape (3, element), then the
            centres of both, each of shape (3,).
        grid: Path length of a cell [m], middle wavenumber and those of the nodes [rad/m].
        beta: Shape of the window.
        out: Real and imaginary part at each node, cell and link, float32, shape
            (node, 2, cell, tx · rx).
    """
    tx_xyz, rx_xyz, tx_centre, rx_centre = ends
    cell_m, centre_k, node_k = grid
    nodes, n_tx, n_rx = len(node_k), tx_xyz.shape[1], rx_xyz.shape[1]
    turns = np.zeros(1 + nodes)
    turns[0] = centre_k / (2.0 * math.pi)
    for m in range(nodes):
        turns[1 + m] = (node_k[m] - centre_k) / (2.0 * math.pi)
    tx_ways = np.zeros((5, n_tx), dtype=np.float32)
    rx_ways = np.zeros((5, n_rx), dtype=np.float32)
    sent = np.zeros((nodes, 2, n_tx), dtype=np.float32)
    heard = np.zeros((nodes, 2, n_rx), dtype=np.float32)
    amplitude = np.zeros((nodes, n_rx), dtype=np.float32)
    damping = np.zeros(nodes, dtype=np.float32)
    kernel = np.zeros(WIDTH, dtype=np.float32)
    size = _size(tx_xyz, tx_centre) + _size(rx_xyz, rx_centre)
    from_tx, from_rx = fields
    for i in range(len(points)):
        a, b = from_tx[i], from_rx[i]
        if (a[0, 0] == 0.0 and a[1, 0] == 0.0) or (b[0, 0] == 0.0 and b[1, 0] == 0.0):
            continue
        p, n, area = points[i], normals[i], areas[i]
        to_tx, to_rx = tx_centre - p, rx_centre - p
        d_t, d_r = _norm(to_tx), _norm(to_rx)
        if _misses(to_tx / d_t, to_rx / d_r, n, area * node_k[0] ** 2 / 24.0, size / min(d_t, d_r)):
            continue
        _elements(p, n, tx_xyz, d_t, turns, tx_ways, sent)
        _elements(p, n, rx_xyz, d_r, turns, rx_ways, heard)
        for m in range(nodes):
            damping[m] = node_k[m] * node_k[m] * area / 24.0
        place = (d_t + d_r) / cell_m
        first = math.ceil(place - 0.5 * WIDTH)
        for w in range(WIDTH):
            x = (first + w - place) / (0.5 * WIDTH)
            kernel[w] = math.exp(beta * (math.sqrt(max(1.0 - x * x, 0.0)) - 1.0))
        scale = area / (8.0 * math.pi)
        for t in range(n_tx):
            if tx_ways[3, t] <= 0.0:
                continue
            _amplitudes(tx_ways, t, rx_ways, damping, amplitude)
            for m in range(nodes):
                # Facets hand θ and φ on; seen from the other end φ points the other way.
                # Kirchhoff's phase is a quarter turn.
                weight = a[0, m] * b[0, m] - a[1, m] * b[1, m]
                weight *= gamma[material[i], m] * np.complex64(1j)
                w_re, w_im = weight.real * scale, weight.imag * scale
                s_re = np.float32(w_re * sent[m, 0, t] - w_im * sent[m, 1, t])
                s_im = np.float32(w_re * sent[m, 1, t] + w_im * sent[m, 0, t])
                _add(amplitude[m], s_re, s_im, heard[m], kernel, first, t * n_rx, out[m])
