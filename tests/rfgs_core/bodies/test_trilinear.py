# SPDX-License-Identifier: Apache-2.0
"""Grids are read as SciPy reads them, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from rfgs_core.bodies.localise import read_grids


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(4, 3, 5), (4, 3, 1), (1, 1, 1)])
def test_readings_are_scipys(shape: tuple[int, int, int], kind: type) -> None:
    """Within, on grid points, on the border and outside."""
    rng = np.random.default_rng(0)
    values = rng.exponential(size=(3, *shape)).astype(kind)
    index = rng.uniform(-2.0, 6.0, (500, 3))
    index[:100] = np.round(index[:100])
    plain = [map_coordinates(grid, index.T, order=1, mode="nearest") for grid in values]
    found = read_grids(values, index)
    assert found.dtype == kind
    np.testing.assert_array_equal(found, plain)


def test_a_plane_is_read_as_in_two_dimensions() -> None:
    rng = np.random.default_rng(1)
    plane, index = rng.exponential(size=(6, 7)), rng.uniform(-1.0, 8.0, (200, 2))
    plain = map_coordinates(plane, index.T, order=1, mode="nearest")
    found = read_grids(plane[None, ..., None], np.column_stack([index, np.zeros(200)]))
    np.testing.assert_array_equal(found[0], plain)
