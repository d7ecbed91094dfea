# SPDX-License-Identifier: Apache-2.0
"""Rendered pictures as bytes, alone or beside the true ones."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

#: White columns between a rendered picture and the true one.
GAP_PX = 4
#: Pictures narrower than this are enlarged for a page or a video [px].
WIDTH_PX = 640


def to_bytes(rgb: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    """Colours in [0, 1] as bytes, rounded."""
    return (rgb * 255.0 + 0.5).clip(0, 255).astype(np.uint8)


def side_by_side(
    left: UInt8[np.ndarray, "h w 3"], right: UInt8[np.ndarray, "h w2 3"]
) -> UInt8[np.ndarray, "h w3 3"]:
    """Two pictures of the same height with a white gap between them."""
    gap = np.full((left.shape[0], GAP_PX, 3), 255, np.uint8)
    return np.concatenate([left, gap, right], axis=1)


def enlarged(picture: UInt8[np.ndarray, "h w 3"], least_px: int) -> UInt8[np.ndarray, "h2 w2 3"]:
    """A picture, enlarged by a whole number where it is narrower than `least_px`."""
    factor = -(-least_px // picture.shape[1])
    size = (picture.shape[1] * factor, picture.shape[0] * factor)
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BICUBIC))
