# SPDX-License-Identifier: Apache-2.0
"""The brightest places of a map that are not next to each other."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def separated_peaks(
    points: Float[np.ndarray, "N 3"], power: Float[np.ndarray, "N"], count: int, apart_m: float
) -> list[int]:
    """Indices of the brightest points that keep their distance, brightest first.

    Args:
        points: Places [m].
        power: Brightness of each; what is not above zero is never chosen.
        count: How many at most.
        apart_m: Least distance between two that are chosen [m].
    """
    remaining = power.astype(np.float64).copy()
    chosen = []
    for _ in range(count):
        best = int(remaining.argmax())
        if remaining[best] <= 0.0:
            break
        chosen.append(best)
        remaining[np.linalg.norm(points - points[best], axis=1) < apart_m] = 0.0
    return chosen
