# SPDX-License-Identifier: Apache-2.0
"""Values of many grids read between their points."""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Float, Float64


def read_grids(
    values: Float[np.ndarray, "grid x y z"], index: Float64[np.ndarray, "N 3"]
) -> Float[np.ndarray, "grid N"]:
    """Trilinear readings of grids of one shape; the border value continues outside.

    Bit for bit those of `scipy.ndimage.map_coordinates(…, order=1, mode="nearest")`, which looks up
    every place anew for each grid and takes ten times as long.

    Args:
        values: One grid after the other.
        index: Where to read, in steps of the grid from its first point.
    """
    out = np.zeros((len(values), len(index)), values.dtype)
    _read(np.ascontiguousarray(values), np.ascontiguousarray(index), out)
    return out


@numba.njit(cache=True)
def _read(values: np.ndarray, index: np.ndarray, out: np.ndarray) -> None:
    last_x, last_y, last_z = values.shape[1] - 1, values.shape[2] - 1, values.shape[3] - 1
    for n in range(len(index)):
        x, y, z = index[n]
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        # In this order, for the last bit.
        x_here, y_here, z_here = 1.0 - (x - i), 1.0 - (y - j), 1.0 - (z - k)
        x_next, y_next, z_next = 1.0 - x_here, 1.0 - y_here, 1.0 - z_here
        i_next, j_next = min(max(i + 1, 0), last_x), min(max(j + 1, 0), last_y)
        k_next = min(max(k + 1, 0), last_z)
        i, j, k = min(max(i, 0), last_x), min(max(j, 0), last_y), min(max(k, 0), last_z)
        for grid in range(len(values)):
            v = values[grid]
            total = v[i, j, k] * x_here * y_here * z_here
            total += v[i, j, k_next] * x_here * y_here * z_next
            total += v[i, j_next, k] * x_here * y_next * z_here
            total += v[i, j_next, k_next] * x_here * y_next * z_next
            total += v[i_next, j, k] * x_next * y_here * z_here
            total += v[i_next, j, k_next] * x_next * y_here * z_next
            total += v[i_next, j_next, k] * x_next * y_next * z_here
            total += v[i_next, j_next, k_next] * x_next * y_next * z_next
            out[grid, n] = total
