# SPDX-License-Identifier: Apache-2.0
"""Whether nothing stands between places."""

from __future__ import annotations

import numba
import numpy as np

from rfgs_core.simulate.geometry.bvh import SAME_M, Bvh
from rfgs_core.simulate.geometry.rays import blocked, new_stack


@numba.njit(cache=True, nogil=True)
def free_segments(bvh: Bvh, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Whether nothing stands between pairs of places, bool, shape (place,).

    Args:
        bvh: What stands.
        starts: Places [m], shape (place, 3).
        ends: The others [m], shape (place, 3).
    """
    stack = new_stack()
    out = np.zeros(len(starts), dtype=np.bool_)
    for i in range(len(starts)):
        out[i] = not blocked(bvh, starts[i], ends[i], 2.0 * SAME_M, stack)
    return out
