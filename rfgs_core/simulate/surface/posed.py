# SPDX-License-Identifier: Apache-2.0
"""Facets of people in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.simulate.geometry.bvh import Bvh


class Facets(NamedTuple):
    """Facets of one frame, and what hides them."""

    points: np.ndarray
    """Positions on the skin [m], shape (facet, 3)."""
    lifted: np.ndarray
    """Positions just outside the skin, to look from [m], shape (facet, 3)."""
    normals: np.ndarray
    """Unit outward normals, shape (facet, 3)."""
    areas: np.ndarray
    """Areas [m²], shape (facet,)."""
    material: np.ndarray
    """Material of each, int64, shape (facet,)."""
    body: np.ndarray
    """Body of each, ascending, int64, shape (facet,)."""
    vertices: np.ndarray
    """Vertices of everything that moves [m], shape (V, 3)."""
    corners: np.ndarray
    """Vertices of each triangle, int64, shape (triangle, 3)."""
    triangles: np.ndarray
    """Triangles of everything that moves [m], shape (triangle, 3, 3)."""
    bvh: Bvh
    """The same for rays."""
