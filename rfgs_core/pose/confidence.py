# SPDX-License-Identifier: Apache-2.0
"""Which joints radio has seen, by how far off they are expected to be, and whether that holds."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from rfgs_core.skeleton import JOINTS

#: A joint counts as seen where it is expected to be off by so much at most [m]. Chosen on fourteen
#: random worlds: more than nine in ten of such joints are then within `NEAR_M`.
SEEN_M = 0.06
#: As far off may a joint be that counts as seen [m].
NEAR_M = 0.08


def confidence(
    error_m: Float64[np.ndarray, "*frame 17"], sigma_m: Float64[np.ndarray, "*frame 17"]
) -> dict[str, float | None]:
    """Whether joints are as far off as is expected.

    Args:
        error_m: How far off joints are [m].
        sigma_m: How far off they are expected to be [m].

    Returns:
        `seen`, the share of joints that count as seen; `seen_near`, the share of these that are off
        by `NEAR_M` at most, None where none counts; `error_over_sigma`, mean error over mean σ.
    """
    seen = sigma_m <= SEEN_M
    return {
        "seen": float(seen.mean()),
        "seen_near": float((error_m[seen] <= NEAR_M).mean()) if seen.any() else None,
        "error_over_sigma": float(error_m.mean() / sigma_m.mean()),
    }


def joints_seen(sigma_m: Float64[np.ndarray, "*frame 17"]) -> dict[str, float]:
    """Share of frames and bodies in which each joint counts as seen, by its name."""
    seen = (sigma_m <= SEEN_M).reshape(-1, len(JOINTS)).mean(axis=0)
    return dict(zip(JOINTS, seen.tolist(), strict=True))
