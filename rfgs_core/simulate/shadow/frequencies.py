# SPDX-License-Identifier: Apache-2.0
"""At which frequencies a shadow is computed, and how it is known at all others.

An edge of a silhouette at Fresnel coordinate ν answers later than the path by τ = ν²/(4 f) and
with 1/(√2 π ν) of its amplitude (Fresnel integral, stationary phase). Over a band B its share of
the factor is a polynomial of degree π B τ or little more, so that few Chebyshev nodes tell the
shadow of near edges, and more that of far ones. Polynomials then give the factor on a grid that is
fine enough for all edges to be linear in between.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rfgs_core.simulate.shadow.silhouette import WINDOW

#: Error of a straight line between neighbours on the grid, relative to the path.
GRID_ERROR = 1e-3
#: Numbers of Chebyshev nodes to choose from.
COUNTS = (3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128, 160, 192, 256)


class Nodes(NamedTuple):
    """Chebyshev nodes over a band and polynomials through them, for each of some counts."""

    counts: np.ndarray
    """Numbers of nodes, ascending, int64, shape (choice,); the last is the grid itself."""
    hz: np.ndarray
    """Nodes of all choices one after another [Hz], shape (sum of counts,)."""
    weights: np.ndarray
    """What the grid takes of each node, shape (sum of counts but the last, grid)."""


def fine_grid(nodes_hz: np.ndarray) -> np.ndarray:
    """A grid between whose points any shadow may be taken as linear.

    On a step Δ the edge at ν is wrong by its amplitude times (2π τ Δ)²/8 = 0.0694 ν³ (Δ/f)².

    Args:
        nodes_hz: Frequencies that are part of it, equally spaced, band edges included [Hz].

    Returns:
        Frequencies [Hz], ascending; the nodes alone where there is only one.
    """
    if len(nodes_hz) == 1:
        return nodes_hz
    curve = np.pi**2 / (32.0 * np.sqrt(2.0) * np.pi) * WINDOW**3
    step_hz = nodes_hz[-1] * math.sqrt(GRID_ERROR / curve)
    parts = math.ceil((nodes_hz[1] - nodes_hz[0]) / step_hz)
    return np.linspace(nodes_hz[0], nodes_hz[-1], (len(nodes_hz) - 1) * parts + 1)


def nodes_for(grid_hz: np.ndarray) -> Nodes:
    """Nodes and polynomials over a grid of frequencies [Hz]."""
    return _nodes_for(tuple(grid_hz.tolist()))


@lru_cache(maxsize=4)
def _nodes_for(grid: tuple[float, ...]) -> Nodes:
    grid_hz = np.array(grid)
    counts = [count for count in COUNTS if count < len(grid)]
    middle, half = 0.5 * (grid_hz[0] + grid_hz[-1]), 0.5 * (grid_hz[-1] - grid_hz[0])
    hz, weights = [], [np.zeros((0, len(grid)))]
    for count in counts:
        angle = (2 * np.arange(count) + 1) * np.pi / (2 * count)
        hz.append(middle + half * np.cos(angle))
        weights.append(_lagrange(angle, (grid_hz - middle) / half))
    return Nodes(
        np.array([*counts, len(grid)]), np.concatenate([*hz, grid_hz]), np.concatenate(weights)
    )


def _lagrange(angle: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Lagrange polynomials of the nodes cos(angle) at places in −1 to 1, shape (node, place).

    Barycentric form; Berrut and Trefethen, SIAM Review 46 (2004), equation 5.3.
    """
    sign = np.where(np.arange(len(angle)) % 2, -1.0, 1.0) * np.sin(angle)
    away = at - np.cos(angle)[:, None]
    at_node = np.abs(away) < 1e-14
    terms = np.where(at_node.any(axis=0), at_node, sign[:, None] / np.where(at_node, 1.0, away))
    return terms / terms.sum(axis=0)
