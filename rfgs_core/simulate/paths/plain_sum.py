# SPDX-License-Identifier: Apache-2.0
"""Sums that become vector code, kept apart from everything else.

numba optimises code that it caches once more than code that it runs at once. Where terms may be
reordered, or either product of a sum of two may be fused with it, the two end in other last bits,
so that the run that compiles would differ from all later ones. In a plain sum there is nothing
left to choose; everything else in this folder is compiled without such freedom.
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(forceinline=True, cache=True, fastmath={"reassoc", "nsz"})
def summed(values: np.ndarray) -> float:
    """Sum of all values, in an order that depends on their number alone."""
    total = 0.0
    for j in range(len(values)):
        total += values[j]
    return total
