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

import numba
import numpy as np

from rfgs_core.simulate.scatter.grid import BETA, WIDTH

#: Facets damped by more than e^-12 are 100 dB weaker than they could be and are left out.
_MOST_DAMPED = 12.0
#: Adding and taking away this rounds a single to whole numbers.
_ROUND = np.float32(12582912.0)
_HALF, _ONE, _TWO = np.float32(0.5), np.float32(1.0), np.float32(2.0)
_PI = np.float32(math.pi)
#: sin and cos of ±π/2 by their series, Taylor's with the last term fitted: errors below 1e-6.
_S3, _S5, _S7, _S9 = (np.float32(v) for v in (-1 / 6, 1 / 120, -1.9841e-4, 2.72e-6))
_C2, _C4, _C6, _C8 = (np.float32(v) for v in (-0.5, 1 / 24, -1.38887e-3, 2.46e-5))
_E3, _E4, _E5 = (np.float32(1.0 / v) for v in (6.0, 24.0, 120.0))
_SIXTEENTH = np.float32(-1.0 / 16.0)
_FAST = {"contract", "nsz", "ninf", "nnan"}


@numba.njit(cache=True, nogil=True, fastmath=_FAST)
def _elements(
    way: np.ndarray,
    n: np.ndarray,
    offsets: np.ndarray,
    turns: np.ndarray,
    seen: np.ndarray,
    phasor: np.ndarray,
) -> None:
    """What one facet sees of an array, beyond its centre.

    Args:
        way: From the facet to the centre [m], shape (3,).
        n: Its normal, shape (3,).
        offsets: Elements from the centre [m], and their squared distance from it [m²], float32,
            shape (4, element).
        turns: Turns per metre at the middle subcarrier, and at each node beyond that, (1 + node,).
        seen: Filled with unit vectors to the elements, their part along the normal and one over
            the distances, float32, shape (5, element).
        phasor: Filled with e^{−jkδ}, δ what each element is farther away than the centre, real
            and imaginary, float32, shape (node, 2, element).
    """
    x, y, z = np.float32(way[0]), np.float32(way[1]), np.float32(way[2])
    nx, ny, nz = np.float32(n[0]), np.float32(n[1]), np.float32(n[2])
    centre_2 = x * x + y * y + z * z
    centre = np.float32(math.sqrt(centre_2))
    along = x * nx + y * ny + z * nz
    ox, oy, oz, o2 = offsets[0], offsets[1], offsets[2], offsets[3]
    s0, s1, s2, s3, s4 = seen[0], seen[1], seen[2], seen[3], seen[4]
    re, im = phasor[0, 0], phasor[0, 1]
    per_m = np.float32(turns[0])
    for e in range(len(ox)):
        farther_2 = _TWO * (x * ox[e] + y * oy[e] + z * oz[e]) + o2[e]
        d = np.sqrt(centre_2 + farther_2)
        inverse = _ONE / d
        s0[e], s1[e], s2[e] = (x + ox[e]) * inverse, (y + oy[e]) * inverse, (z + oz[e]) * inverse
        s3[e] = (along + nx * ox[e] + ny * oy[e] + nz * oz[e]) * inverse
        s4[e] = inverse
        # The difference of two roots, without losing its digits.
        delta = farther_2 / (d + centre)
        phasor[len(phasor) - 1, 1, e] = delta
    deltas = phasor[len(phasor) - 1, 1].copy()
    for e in range(len(ox)):
        turn = per_m * deltas[e]
        a = _PI * (turn - ((turn + _ROUND) - _ROUND))
        b = a * a
        s = a * (_ONE + b * (_S3 + b * (_S5 + b * (_S7 + b * _S9))))
        c = _ONE + b * (_C2 + b * (_C4 + b * (_C6 + b * _C8)))
        # sin and cos of 2a: at a = ±π/2 both series are at their worst, their product is not.
        re[e] = _ONE - _TWO * s * s
        im[e] = -_TWO * s * c
    base_re, base_im = phasor[0, 0].copy(), phasor[0, 1].copy()
    for m in range(len(phasor)):
        more = np.float32(2.0 * math.pi * turns[1 + m])
        row_re, row_im = phasor[m, 0], phasor[m, 1]
        for e in range(len(ox)):
            a = more * deltas[e]
            b = a * a
            s = a * (_ONE + b * (_S3 + b * _S5))
            c = _ONE + b * (_C2 + b * (_C4 + b * _C6))
            row_re[e] = base_re[e] * c + base_im[e] * s
            row_im[e] = base_im[e] * c - base_re[e] * s


@numba.njit(cache=True, nogil=True, fastmath=_FAST)
def _amplitudes(tx: np.ndarray, t: int, rx: np.ndarray, damping: float, out: np.ndarray) -> None:
    """Real amplitude of one facet between an element and all of an array.

    Args:
        tx: What the facet sees of the transmitting elements, see `_elements`.
        t: Which of them.
        rx: What it sees of the receiving elements.
        damping: k² A / 24.
        out: Filled, float32, shape (rx,).
    """
    x, y, z, along, near = tx[0, t], tx[1, t], tx[2, t], tx[3, t], tx[4, t]
    r0, r1, r2, r3, r4 = rx[0], rx[1], rx[2], rx[3], rx[4]
    factor, most, none = np.float32(damping), np.float32(_MOST_DAMPED), np.float32(0.0)
    for r in range(len(r0)):
        c = along + r3[r]
        q_t2 = _TWO + _TWO * (x * r0[r] + y * r1[r] + z * r2[r]) - c * c
        e = factor * max(q_t2, none)
        lit = (r3[r] > none) & (e < most)
        # e^−e = (e^−e/16)^16, the inner one by its series.
        a = min(e, most) * _SIXTEENTH
        s = _ONE + a * (_ONE + a * (_HALF + a * (_E3 + a * (_E4 + a * _E5))))
        s = s * s
        s = s * s
        s = s * s
        s = s * s
        value = c * near * r4[r] * s
        out[r] = value if lit else none


@numba.njit(cache=True, nogil=True, fastmath=_FAST)
def _add(
    amplitude: np.ndarray,
    sent: complex,
    heard: np.ndarray,
    kernel: np.ndarray,
    first: int,
    lanes: int,
    out: np.ndarray,
) -> None:
    """Adds one facet, element and node to the cells of its delay.

    Args:
        amplitude: Real amplitude per receiving element, shape (rx,).
        sent: Weight of the facet times the phasor of the transmitting element.
        heard: Phasors of the receiving elements, shape (2, rx).
        kernel: The window over the cells, shape (`WIDTH`,).
        first: First cell.
        lanes: First of the links.
        out: The grid of a node, float32, shape (2, cell, link).
    """
    h_re, h_im = heard[0], heard[1]
    s_re, s_im = np.float32(sent.real), np.float32(sent.imag)
    k_0, k_1, k_2, k_3 = kernel[0], kernel[1], kernel[2], kernel[3]
    end = lanes + len(h_re)
    cells = out.shape[1]
    c_0, c_1, c_2, c_3 = (
        first % cells,
        (first + 1) % cells,
        (first + 2) % cells,
        (first + 3) % cells,
    )
    re_0, re_1, re_2, re_3 = (
        out[0, c_0, lanes:end],
        out[0, c_1, lanes:end],
        out[0, c_2, lanes:end],
        out[0, c_3, lanes:end],
    )
    im_0, im_1, im_2, im_3 = (
        out[1, c_0, lanes:end],
        out[1, c_1, lanes:end],
        out[1, c_2, lanes:end],
        out[1, c_3, lanes:end],
    )
    for r in range(len(h_re)):
        re = amplitude[r] * (s_re * h_re[r] - s_im * h_im[r])
        re_0[r] += k_0 * re
        re_1[r] += k_1 * re
        re_2[r] += k_2 * re
        re_3[r] += k_3 * re
    for r in range(len(h_re)):
        im = amplitude[r] * (s_re * h_im[r] + s_im * h_re[r])
        im_0[r] += k_0 * im
        im_1[r] += k_1 * im
        im_2[r] += k_2 * im
        im_3[r] += k_3 * im


@numba.njit(cache=True, nogil=True)
def seen_from_centres(
    to_tx: np.ndarray, to_rx: np.ndarray, n: np.ndarray, damping: float, spread: float
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
    if damping * q_t2 < _MOST_DAMPED:
        return True
    q_t = max(math.sqrt(max(q_t2, 0.0)) - 2.0 * spread, 0.0)
    return damping * q_t * q_t < _MOST_DAMPED


@numba.njit(cache=True, nogil=True, error_model="numpy")
def spread_facets(
    points: np.ndarray,
    normals: np.ndarray,
    areas: np.ndarray,
    gamma: np.ndarray,
    material: np.ndarray,
    used: np.ndarray,
    from_rx: np.ndarray,
    from_tx: tuple[np.ndarray, np.ndarray],
    ends: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    grid: tuple[float, float, np.ndarray, float],
    exact: np.ndarray,
    onto: np.ndarray,
    out: np.ndarray,
) -> None:
    """Adds facets between one array and several others to the grids of their links.

    Args:
        points: Positions [m], shape (facet, 3).
        normals: Unit normals, shape (facet, 3).
        areas: Areas [m²], shape (facet,).
        gamma: Reflection coefficient of each material, complex64, shape (material, node).
        material: Material of each facet, shape (facet,).
        used: Facets that the receiving array hears, int64.
        from_rx: θ and φ of what reaches each facet from it, complex64, shape (facet, 2, node).
        from_tx: The same of all transmitting arrays, 0 where a facet is hidden, shape
            (way, facet, 2, node), and which of them to take.
        ends: Centres [m] and offsets of the transmitting arrays, shapes (way, 3) and
            (way, 4, element), as `_elements` takes them; centre and offsets of the receiving one.
        grid: Path length of a cell [m], middle wavenumber, those of the nodes [rad/m], and the
            size of both arrays together [m].
        exact: Whether amplitudes of a way are those of each pair of elements, shape (way,).
        onto: Grid that each transmitting array adds to, shape (way,).
        out: Real and imaginary part at each node, cell and link, float32, shape
            (grid, node, 2, cell, tx · rx).
    """
    tx_fields, ways = from_tx
    tx_centre, tx_offset, rx_centre, rx_offset = ends
    cell_m, centre_k, node_k, size_m = grid
    nodes, n_tx, n_rx = len(node_k), tx_offset.shape[2], rx_offset.shape[1]
    turns = np.zeros(1 + nodes)
    turns[0] = centre_k / (2.0 * math.pi)
    for m in range(nodes):
        turns[1 + m] = (node_k[m] - centre_k) / (2.0 * math.pi)
    tx_seen = np.zeros((5, n_tx), dtype=np.float32)
    rx_seen = np.zeros((5, n_rx), dtype=np.float32)
    sent = np.zeros((nodes, 2, n_tx), dtype=np.float32)
    heard = np.zeros((nodes, 2, n_rx), dtype=np.float32)
    amplitude = np.zeros(n_rx, dtype=np.float32)
    kernel = np.zeros(WIDTH, dtype=np.float32)
    weight = np.zeros(nodes, dtype=np.complex128)
    for i in used:
        p, n, area, b = points[i], normals[i], areas[i], from_rx[i]
        to_rx = rx_centre - p
        d_r = math.sqrt((to_rx * to_rx).sum())
        unit_rx, ready = to_rx / d_r, False
        damping = area / 24.0
        for w in ways:
            a = tx_fields[w, i]
            if a[0, 0] == 0.0 and a[1, 0] == 0.0:
                continue
            to_tx = tx_centre[w] - p
            d_t = math.sqrt((to_tx * to_tx).sum())
            unit_tx, spread = to_tx / d_t, size_m / min(d_t, d_r)
            if not seen_from_centres(unit_tx, unit_rx, n, damping * node_k[0] ** 2, spread):
                continue
            if not ready:
                _elements(to_rx, n, rx_offset, turns, rx_seen, heard)
                ready = True
            _elements(to_tx, n, tx_offset[w], turns, tx_seen, sent)
            place = (d_t + d_r) / cell_m
            first = math.ceil(place - 0.5 * WIDTH)
            for c in range(WIDTH):
                x = (first + c - place) / (0.5 * WIDTH)
                kernel[c] = math.exp(BETA * (math.sqrt(max(1.0 - x * x, 0.0)) - 1.0))
            angle = -centre_k * (d_t + d_r)
            # Facets hand θ and φ on; seen from the other end φ points the other way. Kirchhoff's
            # phase is a quarter turn.
            common = complex(math.cos(angle), math.sin(angle)) * 1j * (area / (8.0 * math.pi))
            for m in range(nodes):
                passed_on = a[0, m] * b[0, m] - a[1, m] * b[1, m]
                weight[m] = common * passed_on * gamma[material[i], m]
            if not exact[w]:
                c = (unit_tx * n).sum() + (unit_rx * n).sum()
                q = unit_tx + unit_rx
                q_t2 = max((q * q).sum() - c * c, 0.0)
                for m in range(nodes):
                    weight[m] *= c / d_t * math.exp(-damping * q_t2 * node_k[m] ** 2)
            for t in range(n_tx):
                if exact[w] and tx_seen[3, t] <= 0.0:
                    continue
                for m in range(nodes):
                    if exact[w]:
                        _amplitudes(tx_seen, t, rx_seen, damping * node_k[m] ** 2, amplitude)
                    part = weight[m] * complex(sent[m, 0, t], sent[m, 1, t])
                    row = amplitude if exact[w] else rx_seen[4]
                    _add(row, part, heard[m], kernel, first, t * n_rx, out[onto[w], m])
