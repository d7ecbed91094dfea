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
    to: tuple[float, float, float],
    centre_m: float,
    n: tuple[float, float, float],
    offsets: np.ndarray,
    turns: np.ndarray,
    seen: np.ndarray,
    phasor: np.ndarray,
) -> None:
    """What one facet sees of an array, beyond its centre.

    Args:
        to: Unit vector from the facet to the centre.
        centre_m: Distance of the centre [m].
        n: Its normal.
        offsets: Elements from the centre [m], and their squared distance from it [m²], float32,
            shape (4, element).
        turns: Turns per metre at the middle subcarrier, and at each node beyond that, (1 + node,).
        seen: Filled with unit vectors to the elements, their part along the normal, one over the
            distances, δ, and the phasor at the middle subcarrier, float32, shape (8, element).
        phasor: Filled with e^{−jkδ}, δ what each element is farther away than the centre, real
            and imaginary, float32, shape (node, 2, element).
    """
    centre = np.float32(centre_m)
    x, y, z = np.float32(to[0]) * centre, np.float32(to[1]) * centre, np.float32(to[2]) * centre
    nx, ny, nz = np.float32(n[0]), np.float32(n[1]), np.float32(n[2])
    centre_2 = centre * centre
    along = x * nx + y * ny + z * nz
    ox, oy, oz, o2 = offsets[0], offsets[1], offsets[2], offsets[3]
    s0, s1, s2, s3, s4 = seen[0], seen[1], seen[2], seen[3], seen[4]
    deltas, re, im = seen[5], seen[6], seen[7]
    per_m = np.float32(turns[0])
    for e in range(len(ox)):
        farther_2 = _TWO * (x * ox[e] + y * oy[e] + z * oz[e]) + o2[e]
        d = np.sqrt(centre_2 + farther_2)
        inverse = _ONE / d
        s0[e], s1[e], s2[e] = (x + ox[e]) * inverse, (y + oy[e]) * inverse, (z + oz[e]) * inverse
        s3[e] = (along + nx * ox[e] + ny * oy[e] + nz * oz[e]) * inverse
        s4[e] = inverse
        # The difference of two roots, without losing its digits.
        deltas[e] = farther_2 / (d + centre)
    for e in range(len(ox)):
        turn = per_m * deltas[e]
        a = _PI * (turn - ((turn + _ROUND) - _ROUND))
        b = a * a
        s = a * (_ONE + b * (_S3 + b * (_S5 + b * (_S7 + b * _S9))))
        c = _ONE + b * (_C2 + b * (_C4 + b * (_C6 + b * _C8)))
        # sin and cos of 2a: at a = ±π/2 both series are at their worst, their product is not.
        re[e] = _ONE - _TWO * s * s
        im[e] = -_TWO * s * c
    for m in range(len(phasor)):
        more = np.float32(2.0 * math.pi * turns[1 + m])
        row_re, row_im = phasor[m, 0], phasor[m, 1]
        for e in range(len(ox)):
            a = more * deltas[e]
            b = a * a
            s = a * (_ONE + b * (_S3 + b * _S5))
            c = _ONE + b * (_C2 + b * (_C4 + b * _C6))
            row_re[e] = re[e] * c + im[e] * s
            row_im[e] = im[e] * c - re[e] * s


@numba.njit(cache=True, nogil=True, fastmath=_FAST)
def _exact(
    tx: np.ndarray,
    rx: np.ndarray,
    sent: np.ndarray,
    heard: np.ndarray,
    weight: complex,
    damping: float,
    out: np.ndarray,
) -> None:
    """Channel of one facet at one node between all pairs of elements.

    Args:
        tx: What the facet sees of the transmitting elements, see `_elements`.
        rx: What it sees of the receiving ones.
        sent: Phasors of the transmitting elements, shape (2, tx).
        heard: Those of the receiving ones, shape (2, rx).
        weight: What all links have in common.
        damping: k² A / 24.
        out: Filled, real and imaginary, float32, shape (2, tx · rx).
    """
    r0, r1, r2, r3, r4 = rx[0], rx[1], rx[2], rx[3], rx[4]
    h_re, h_im = heard[0], heard[1]
    factor, most, none = np.float32(damping), np.float32(_MOST_DAMPED), np.float32(0.0)
    count = len(r0)
    for t in range(tx.shape[1]):
        x, y, z, along = tx[0, t], tx[1, t], tx[2, t], tx[3, t]
        near = tx[4, t] if along > none else none
        part = weight * complex(sent[0, t], sent[1, t])
        s_re, s_im = np.float32(part.real) * near, np.float32(part.imag) * near
        re, im = out[0, t * count : (t + 1) * count], out[1, t * count : (t + 1) * count]
        for r in range(count):
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
            value = c * r4[r] * s if lit else none
            re[r] = value * (s_re * h_re[r] - s_im * h_im[r])
            im[r] = value * (s_re * h_im[r] + s_im * h_re[r])


@numba.njit(cache=True, nogil=True, fastmath=_FAST)
def _of_centres(
    rx: np.ndarray, sent: np.ndarray, heard: np.ndarray, weight: complex, out: np.ndarray
) -> None:
    """The same with the amplitude of the centres, which is part of the weight."""
    near, h_re, h_im = rx[4], heard[0], heard[1]
    count = len(near)
    for t in range(sent.shape[1]):
        part = weight * complex(sent[0, t], sent[1, t])
        s_re, s_im = np.float32(part.real), np.float32(part.imag)
        re, im = out[0, t * count : (t + 1) * count], out[1, t * count : (t + 1) * count]
        for r in range(count):
            re[r] = near[r] * (s_re * h_re[r] - s_im * h_im[r])
            im[r] = near[r] * (s_re * h_im[r] + s_im * h_re[r])


@numba.njit(cache=True, nogil=True, fastmath=_FAST)
def _spread(values: np.ndarray, kernel: np.ndarray, first: int, out: np.ndarray) -> None:
    """Adds the values of all links to the cells around a delay.

    Args:
        values: Real and imaginary, float32, shape (2, link).
        kernel: The window over the cells, shape (`WIDTH`,).
        first: First cell, which may lie beyond the grid.
        out: The grid of a node, float32, shape (2, cell, link).
    """
    cells = out.shape[1]
    a, b, c, d = first % cells, (first + 1) % cells, (first + 2) % cells, (first + 3) % cells
    k_a, k_b, k_c, k_d = kernel[0], kernel[1], kernel[2], kernel[3]
    for part in range(2):
        row = values[part]
        at_a, at_b, at_c, at_d = out[part, a], out[part, b], out[part, c], out[part, d]
        for link in range(len(row)):
            value = row[link]
            at_a[link] += k_a * value
            at_b[link] += k_b * value
            at_c[link] += k_c * value
            at_d[link] += k_d * value


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
    if damping * q_t2 < _MOST_DAMPED:
        return True
    q_t = max(math.sqrt(max(q_t2, 0.0)) - 2.0 * spread, 0.0)
    return damping * q_t * q_t < _MOST_DAMPED


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
    scale: float,
    node_k: np.ndarray,
    weight: np.ndarray,
) -> None:
    """Multiplies weights by the amplitude at the centres, but for the way to the receiver.

    Args:
        to_tx: Unit vector to the centre of the transmitting array.
        to_rx: That to the receiving one.
        n: Normal.
        scale: Area / 24 [m²].
        node_k: Wavenumbers of the nodes [rad/m].
        weight: Changed, shape (node,).
    """
    c = to_tx[0] * n[0] + to_tx[1] * n[1] + to_tx[2] * n[2]
    c += to_rx[0] * n[0] + to_rx[1] * n[1] + to_rx[2] * n[2]
    qx, qy, qz = to_tx[0] + to_rx[0], to_tx[1] + to_rx[1], to_tx[2] + to_rx[2]
    q_t2 = max(qx * qx + qy * qy + qz * qz - c * c, 0.0)
    for m in range(len(weight)):
        weight[m] *= c * math.exp(-scale * q_t2 * node_k[m] * node_k[m])


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
    turns[1:] = (node_k - centre_k) / (2.0 * math.pi)
    tx_seen = np.zeros((8, n_tx), dtype=np.float32)
    rx_seen = np.zeros((8, n_rx), dtype=np.float32)
    sent = np.zeros((nodes, 2, n_tx), dtype=np.float32)
    heard = np.zeros((nodes, 2, n_rx), dtype=np.float32)
    values = np.zeros((2, n_tx * n_rx), dtype=np.float32)
    kernel, weight = np.zeros(WIDTH, dtype=np.float32), np.zeros(nodes, dtype=np.complex128)
    for i in used:
        b, scale = from_rx[i], areas[i] / 24.0
        n = normals[i, 0], normals[i, 1], normals[i, 2]
        to_rx, d_r = _towards(points[i], rx_centre)
        ready = False
        for w in ways:
            a = tx_fields[w, i]
            if a[0, 0] == 0.0 and a[1, 0] == 0.0:
                continue
            to_tx, d_t = _towards(points[i], tx_centre[w])
            if not seen_from_centres(
                to_tx, to_rx, n, scale * node_k[0] ** 2, size_m / min(d_t, d_r)
            ):
                continue
            if not ready:
                _elements(to_rx, d_r, n, rx_offset, turns, rx_seen, heard)
                ready = True
            _elements(to_tx, d_t, n, tx_offset[w], turns, tx_seen, sent)
            first = _window((d_t + d_r) / cell_m, kernel)
            _weights(a, b, gamma[material[i]], d_t + d_r, centre_k, areas[i], weight)
            if not exact[w]:
                _damp(to_tx, to_rx, n, scale, node_k, weight)
                weight /= d_t
            for m in range(nodes):
                if exact[w]:
                    damping = scale * node_k[m] ** 2
                    _exact(tx_seen, rx_seen, sent[m], heard[m], weight[m], damping, values)
                else:
                    _of_centres(rx_seen, sent[m], heard[m], weight[m], values)
                _spread(values, kernel, first, out[onto[w], m])


@numba.njit(cache=True, nogil=True)
def _towards(p: np.ndarray, place: np.ndarray) -> tuple[tuple[float, float, float], float]:
    """Unit vector from a point to a place, and their distance [m]."""
    x, y, z = place[0] - p[0], place[1] - p[1], place[2] - p[2]
    d = math.sqrt(x * x + y * y + z * z)
    return (x / d, y / d, z / d), d
