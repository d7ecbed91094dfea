# SPDX-License-Identifier: Apache-2.0
"""Rendered pictures as bytes, alone or beside the true ones."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8

#: White columns between a rendered picture and the true one.
GAP_PX = 4


def to_bytes(rgb: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    """Colours in [0, 1] as bytes, rounded."""
    return (rgb * 255.0 + 0.5).clip(0, 255).astype(np.uint8)


def side_by_side(
    left: UInt8[np.ndarray, "h w 3"], right: UInt8[np.ndarray, "h w2 3"]
) -> UInt8[np.ndarray, "h w3 3"]:
    """Two pictures of the same height with a white gap between them."""
    gap = np.full((left.shape[0], GAP_PX, 3), 255, np.uint8)
    return np.concatenate([left, gap, right], axis=1)
