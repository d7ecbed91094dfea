# SPDX-License-Identifier: Apache-2.0
"""From paths between centres of sites to every antenna element and subcarrier.

A path of specular reflections and refractions has one mirror image of its transmitter: the
element-to-element distance is |r − I(t)|, exact for plane surfaces, which is the design's
|L k_r − r| − L with both ends moved. A path through a scattering point is two such legs, one
seen from each end. Amplitudes scale with the changed distance.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numba
import numpy as np

from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import images
from rfgs_core.radio.sites import ports
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.paths.plain_sum import summed

#: Most paths at a time, and what their number is rounded up to, for vector code.
_BLOCK, _SIMD_WIDTH = 128, 8


def steer(
    paths: PathSet,
    layout: Layout,
    freq_hz: np.ndarray,
    nodes_hz: np.ndarray,
    transmission: np.ndarray | None = None,
    less: float = 0.0,
) -> np.ndarray:
    """Sums paths for every measured pair of elements and every subcarrier.

    H(f) = Σ_p a_p(f) T_p(f) e^{−j2πf d_p/c}, distances in double precision, paths in their own
    order within each link, so the bytes do not depend on the number of threads.

    Args:
        paths: Paths, sorted.
        layout: Antenna elements.
        freq_hz: Equally spaced subcarriers [Hz].
        nodes_hz: Frequencies of the amplitudes, ascending; linear in between.
        transmission: Shadow factors, shape (path, tx place of the site, rx place of the site,
            node); None for none.
        less: Taken off each of these factors; 1 leaves what shadows change.

    Returns:
        Complex128, shape (tx, rx, subcarrier).
    """
    out = np.zeros((len(layout.tx_xyz), len(layout.rx_xyz), len(freq_hz)), dtype=np.complex128)
    if not len(paths):
        return out
    seen = images(paths.vertices, paths.kinds)
    left, share = _interpolation(freq_hz, nodes_hz)
    wavenumber = 2.0 * np.pi * np.asarray(freq_hz, dtype=np.float64) / SPEED_OF_LIGHT
    if transmission is None:
        transmission = np.ones((0, 0, 0, 0), dtype=np.complex64)
    step = float(wavenumber[1] - wavenumber[0]) if len(wavenumber) > 1 else 0.0
    for a, b in np.unique(np.stack([paths.tx, paths.rx], axis=1), axis=0):
        of_pair = np.flatnonzero((paths.tx == a) & (paths.rx == b))
        ends = np.stack([paths.vertices[of_pair[0], 0], paths.vertices[of_pair[0], -1]])
        for port, (i, j) in enumerate(ports(layout)):
            tx = np.flatnonzero((layout.tx_site == a) & (layout.tx_port == i))
            rx = np.flatnonzero((layout.rx_site == b) & (layout.rx_port == j))
            offsets = np.einsum("pij,ej->pei", seen.mirror[of_pair], layout.tx_xyz[tx] - ends[0])
            out[np.ix_(tx, rx)] = _steer(
                np.ascontiguousarray(paths.amplitude[of_pair, port]),
                (transmission, of_pair, less),
                seen.one_sided[of_pair],
                (seen.seen_from_tx[of_pair], seen.seen_from_rx[of_pair], seen.middle_m[of_pair]),
                np.ascontiguousarray(offsets),
                ends,
                np.ascontiguousarray(layout.tx_xyz[tx]),
                np.ascontiguousarray(layout.rx_xyz[rx]),
                (left, share, float(wavenumber[0]), step),
            )
    out[~layout.measured] = 0.0
    return out


def resampled(paths: PathSet, nodes_hz: np.ndarray, grid_hz: np.ndarray) -> PathSet:
    """The same paths with the amplitudes that `steer` would take at other frequencies.

    Args:
        paths: Paths with amplitudes at nodes.
        nodes_hz: These nodes [Hz], ascending.
        grid_hz: Frequencies between them [Hz], shape (grid,).
    """
    left, share = _interpolation(grid_hz, nodes_hz)
    right = np.minimum(left + 1, len(nodes_hz) - 1)
    known = paths.amplitude
    return replace(paths, amplitude=(1.0 - share) * known[..., left] + share * known[..., right])


def _interpolation(freq_hz: np.ndarray, nodes_hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left node of each subcarrier and the share of the right one."""
    if len(nodes_hz) == 1:
        return np.zeros(len(freq_hz), dtype=np.int64), np.zeros(len(freq_hz))
    left = np.clip(np.searchsorted(nodes_hz, freq_hz, side="right") - 1, 0, len(nodes_hz) - 2)
    return left, (freq_hz - nodes_hz[left]) / (nodes_hz[left + 1] - nodes_hz[left])


@numba.njit(cache=True, inline="always")
def _distance(a: np.ndarray, b: np.ndarray) -> float:
    """Distance of two points."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)


@numba.njit(cache=True, inline="always")
def _path_to(
    one_sided: bool,
    seen: tuple[np.ndarray, np.ndarray, float],
    image_offset: np.ndarray,
    ends: np.ndarray,
    tx: np.ndarray,
    rx: np.ndarray,
) -> tuple[float, float]:
    """Length of a path between two elements [m] and its amplitude relative to the centres'."""
    seen_from_tx, seen_from_rx, middle_m = seen
    if one_sided:
        d = _distance(rx - image_offset, seen_from_rx)
        return d, _distance(ends[1], seen_from_rx) / d
    at_tx, at_rx = _distance(tx, seen_from_tx), _distance(rx, seen_from_rx)
    scale = _distance(ends[0], seen_from_tx) / at_tx * _distance(ends[1], seen_from_rx) / at_rx
    return at_tx + middle_m + at_rx, scale


@numba.njit(cache=True)
def _add_block(
    phasor: np.ndarray, turn: np.ndarray, gain: np.ndarray, subcarriers: tuple, out: np.ndarray
) -> None:
    """Adds a block of paths to every subcarrier of one link.

    Args:
        phasor: Real and imaginary part at the first subcarrier, shape (2, path); changed.
        turn: Factor from subcarrier to subcarrier, shape (2, path).
        gain: Amplitudes, shape (node, 2, path).
        subcarriers: Left node of each subcarrier and share of the right one.
        out: Channel of the link, shape (subcarrier,).
    """
    left, share = subcarriers
    # Rows of their own: one index that cannot be negative, so the loop becomes vector code.
    phasor_re, phasor_im, turn_re, turn_im = phasor[0], phasor[1], turn[0], turn[1]
    term_re, term_im = np.zeros(len(phasor_re)), np.zeros(len(phasor_re))
    for f in range(len(left)):
        low, high = gain[left[f]], gain[min(left[f] + 1, len(gain) - 1)]
        low_re, low_im, high_re, high_im = low[0], low[1], high[0], high[1]
        part = share[f]
        rest = 1.0 - part
        for j in range(len(phasor_re)):
            re, im = phasor_re[j], phasor_im[j]
            a_re = rest * low_re[j] + part * high_re[j]
            a_im = rest * low_im[j] + part * high_im[j]
            term_re[j] = a_re * re - a_im * im
            term_im[j] = a_re * im + a_im * re
            phasor_re[j] = re * turn_re[j] - im * turn_im[j]
            phasor_im[j] = re * turn_im[j] + im * turn_re[j]
        out[f] += complex(summed(term_re), summed(term_im))


@numba.njit(cache=True, parallel=True)
def _steer(
    amplitude: np.ndarray,
    passed: tuple[np.ndarray, np.ndarray, float],
    one_sided: np.ndarray,
    seen: tuple[np.ndarray, np.ndarray, np.ndarray],
    image_offset: np.ndarray,
    ends: np.ndarray,
    tx_xyz: np.ndarray,
    rx_xyz: np.ndarray,
    subcarriers: tuple[np.ndarray, np.ndarray, float, float],
) -> np.ndarray:
    """Channel of one pair of sites and ports, shape (tx, rx, subcarrier)."""
    factors, of_pair, less = passed
    left, share, k_0, k_step = subcarriers
    n_paths, n_nodes = amplitude.shape
    n_tx, n_rx = len(tx_xyz), len(rx_xyz)
    out = np.zeros((n_tx, n_rx, len(left)), dtype=np.complex128)
    for link in numba.prange(n_tx * n_rx):
        t, r = link // n_rx, link % n_rx
        width = min(_BLOCK, (n_paths + _SIMD_WIDTH - 1) // _SIMD_WIDTH * _SIMD_WIDTH)
        phasor, turn = np.zeros((2, width)), np.zeros((2, width))
        block = np.zeros((n_nodes, 2, width))
        for first in range(0, n_paths, width):
            size = min(width, n_paths - first)
            phasor[:] = 0.0
            block[:] = 0.0
            for j in range(size):
                p = first + j
                corners = (seen[0][p], seen[1][p], seen[2][p])
                d, scale = _path_to(
                    one_sided[p], corners, image_offset[p, t], ends, tx_xyz[t], rx_xyz[r]
                )
                phasor[0, j] = scale * math.cos(k_0 * d)
                phasor[1, j] = -scale * math.sin(k_0 * d)
                turn[0, j] = math.cos(k_step * d)
                turn[1, j] = -math.sin(k_step * d)
                for n in range(n_nodes):
                    value = amplitude[p, n]
                    if factors.size:
                        value *= factors[of_pair[p], t, r, n] - less
                    block[n, 0, j] = value.real
                    block[n, 1, j] = value.imag
            _add_block(phasor, turn, block, (left, share), out[t, r])
    return out
