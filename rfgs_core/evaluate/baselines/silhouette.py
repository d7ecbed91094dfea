# SPDX-License-Identifier: Apache-2.0
"""Baselines of pictures: the empty room, and a flat silhouette in front of it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from rfgs_core.evaluate.image import Picture


def empty_picture(empty: Float[np.ndarray, "h w 3"]) -> Picture:
    """The room without anybody."""
    return Picture.cut(empty, np.zeros(empty.shape[:2], dtype=bool))


def silhouette_picture(
    empty: Float[np.ndarray, "h w 3"],
    person: Bool[np.ndarray, "h w"],
    colour: Float[np.ndarray, "3"],
) -> Picture:
    """The true mask filled with the mean training colour: perfect outline, no detail.

    It knows the outline, which no radio method is told; to beat it in `psnr_person` takes a
    right outline and some shading.
    """
    return Picture.cut(np.where(person[..., None], colour, empty), person)
