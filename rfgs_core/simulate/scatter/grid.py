# SPDX-License-Identifier: Apache-2.0
"""From scatterers to subcarriers by a grid of delays: a non-uniform Fourier transform.

A scatterer at path length D adds g(k) e^{−j(k−k_c)D} to the channel. The fast turning part is
spread over a few cells of a delay grid with a window and Fourier transformed at once for all
scatterers; what is left, g(k), varies slowly over the band (facets, walls, the few centimetres
between an element and the centre of its array) and is kept at a few nodes, between which a
polynomial is put through. Window and error bound: Barnett, Magland and af Klinteberg, SIAM J.
Sci. Comput. 41 (2019) C479, "exponential of semicircle".
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Cells that a scatterer is spread over: errors of 1e-3 of its amplitude, at twice the cells of
#: the subcarriers.
WIDTH = 4
#: Shape of the window, 2.30 per cell.
BETA = 2.30 * WIDTH
#: Largest error of the polynomial through the nodes.
_NODE_ERROR = 3e-3
#: Fewest and most nodes of a band.
_LEAST, _MOST = 3, 24


class DelayGrid(NamedTuple):
    """Delay grid and nodes of a radio."""

    cells: int
    """Number of cells; delays beyond them wrap around, as they do on the subcarriers."""
    cell_m: float
    """Path length of a cell [m]."""
    centre_k: float
    """Wavenumber k_c of the middle subcarrier [rad/m]."""
    node_k: np.ndarray
    """Wavenumbers of the nodes, equally spaced [rad/m], shape (node,)."""
    share: np.ndarray
    """What each subcarrier takes of each node, the window undone, shape (node, subcarrier)."""
    row: np.ndarray
    """Output of the Fourier transform that each subcarrier is, shape (subcarrier,)."""

    @property
    def node_hz(self) -> np.ndarray:
        """Frequencies of the nodes [Hz], shape (node,)."""
        return self.node_k * (SPEED_OF_LIGHT / (2.0 * np.pi))


def delay_grid(radio: Radio, layout: Layout, slab_s: float = 0.0) -> DelayGrid:
    """Grid and nodes for the subcarriers of a radio.

    Args:
        radio: The radio.
        layout: Its elements; the sizes of arrays count.
        slab_s: Time that its waves spend in slabs, at most [s].
    """
    k = 2.0 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
    count = len(k)
    middle = count // 2
    step = (k[-1] - k[0]) / max(count - 1, 1)
    cells = max(2 * count, 4 * WIDTH)
    half = max(0.5 * (k[-1] - k[0]), 1e-9)
    reach_m = array_reach(layout.tx_xyz, layout.tx_site) + array_reach(
        layout.rx_xyz, layout.rx_site
    )
    turn = half * (reach_m + SPEED_OF_LIGHT * slab_s)
    nodes = _enough(turn, half / k.mean()) if count > 1 else 1
    node_k = np.linspace(k[0], k[-1], nodes) if nodes > 1 else k[middle : middle + 1]
    share = _lagrange(node_k, k)
    offset = np.arange(count) - middle
    # One subcarrier has no delays to tell apart: a cell as long as a wave, all in one.
    cell_m = 2.0 * np.pi / (step * cells) if count > 1 else 1e9
    share = share / window_transform(offset / cells)
    return DelayGrid(cells, cell_m, float(k[middle]), node_k, share, offset % cells)


def window(x: float) -> float:
    """The window at a distance from its middle, −1 to 1."""
    return math.exp(BETA * (math.sqrt(max(1.0 - x * x, 0.0)) - 1.0))


def window_transform(turns: np.ndarray) -> np.ndarray:
    """Fourier transform of the window over `WIDTH` cells at turns per cell."""
    half = 0.5 * WIDTH
    values = [
        half * quad(lambda x, w=2.0 * np.pi * t * half: window(x) * math.cos(w * x), -1, 1)[0]
        for t in np.abs(turns)
    ]
    return np.array(values)


def to_subcarriers(grid: DelayGrid, spread: np.ndarray) -> np.ndarray:
    """Channel of what was spread over the grid.

    Args:
        grid: The grid.
        spread: Real and imaginary part, float32, shape (node, 2, cell, link).

    Returns:
        Complex64, shape (subcarrier, link).
    """
    # A body fills few cells: their rows of the transform alone are cheaper than all of it.
    used = np.flatnonzero(spread.any(axis=(0, 1, 3)))
    parts = spread[:, :, used]
    filled = np.zeros((len(spread), len(used), spread.shape[3]), dtype=np.complex64)
    filled.real, filled.imag = parts[:, 0], parts[:, 1]
    turn = np.exp(-2j * np.pi / grid.cells * np.outer(grid.row, used))
    # All nodes at once: one product of matrices.
    share = (grid.share.T[:, :, None] * turn[:, None]).astype(np.complex64)
    return share.reshape(len(grid.row), -1) @ filled.reshape(-1, spread.shape[3])


def array_reach(xyz: np.ndarray, site: np.ndarray) -> float:
    """Largest distance of an element from the centre of its site [m].

    Args:
        xyz: Elements [m], shape (element, 3).
        site: Site of each, shape (element,).
    """
    return max(
        float(np.linalg.norm(xyz[site == s] - xyz[site == s].mean(axis=0), axis=1).max())
        for s in np.unique(site)
    )


def _enough(turn: float, share: float) -> int:
    """Nodes for phases of ± `turn` [rad] and facets over a relative half width of `share`.

    A facet damped by e^−6, the last that matters, goes as e^{−12 share x} over the band. Between
    n equally spaced nodes of [−1, 1] a function e^{ax} is off by a^n/n! times the largest product
    of distances, (2/n)^n (n/4)! or less.
    """
    speed = math.hypot(turn, 12.0 * share)
    for count in range(_LEAST, _MOST):
        gap = 2.0 / (count - 1)
        error = speed**count * gap**count / (4.0 * count)
        if error < _NODE_ERROR:
            return count
    return _MOST


def _lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Polynomials through equally spaced nodes at other places, shape (node, place)."""
    out = np.ones((len(nodes), len(at)))
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            if i != j:
                out[i] *= (at - nodes[j]) / (nodes[i] - nodes[j])
    return out
