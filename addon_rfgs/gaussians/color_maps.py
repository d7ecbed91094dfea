# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers to colours: ramps, hues, categories and principal components, in plain NumPy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Anchors of a perceptually ordered ramp, dark violet to yellow, linear RGB.
RAMP = np.array(
    [
        [0.06, 0.0, 0.09],
        [0.05, 0.08, 0.26],
        [0.02, 0.28, 0.27],
        [0.11, 0.58, 0.12],
        [0.98, 0.8, 0.02],
    ]
)
#: Colour of what is not known, linear.
UNKNOWN = 0.17
#: Ranges found from the values lie between these percentiles.
PERCENTILES = (5.0, 99.0)
#: Steps of hue between neighbouring categories: far apart, and never the same again.
_GOLDEN = 0.6180339887498949


def linear(encoded: np.ndarray) -> np.ndarray:
    """Linear light of sRGB-encoded values in [0, 1]."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def found_range(values: Sequence[np.ndarray]) -> tuple[float, float]:
    """A range that covers most known values of all arrays; (0, 1) if none is known."""
    known = np.concatenate([np.zeros(0), *(array[np.isfinite(array)] for array in values)])
    if not len(known):
        return 0.0, 1.0
    low, high = np.percentile(known, PERCENTILES)
    return float(low), float(max(high, low + 1e-6))


def ramp(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Linear RGB [M, 3] of values from `low` to `high`; grey where they are not known."""
    known = np.isfinite(values)
    share = np.clip((np.where(known, values, low) - low) / max(high - low, 1e-9), 0, 1)
    steps = np.linspace(0, 1, len(RAMP))
    colors = np.stack([np.interp(share, steps, RAMP[:, i]) for i in range(3)], axis=1)
    return np.where(known[:, None], colors, UNKNOWN)


def hues(turns: np.ndarray, saturation: float = 0.8) -> np.ndarray:
    """Linear RGB [M, 3] of angles in full turns on the circle of hues, 0 red, 1/3 green."""
    known = np.isfinite(turns)
    sector = np.mod(np.where(known, turns, 0.0)[:, None] + np.array([0.0, 2 / 3, 1 / 3]), 1.0) * 6
    pure = np.clip(np.abs(sector - 3) - 1, 0, 1)
    colors = linear(1 - saturation * (1 - pure))
    return np.where(known[:, None], colors, UNKNOWN)


def categories(ids: np.ndarray) -> np.ndarray:
    """Linear RGB [M, 3], one hue per number, the same in every frame."""
    return hues(np.mod(ids.astype(np.float64) * _GOLDEN, 1.0), 0.75)


def principal_colors(features: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Linear RGB [M, 3] from the first three principal components over all arrays together.

    Args:
        features: One [M, F] per frame, F the same.

    Returns:
        One array per frame. Each component is turned so that its largest entry is positive, and
        shown between its percentiles, so equal features have equal colours in all frames.
    """
    count = sum(len(rows) for rows in features)
    if not count:
        return [np.zeros((0, 3)) for _ in features]
    mean = np.sum([rows.sum(axis=0, dtype=np.float64) for rows in features], axis=0) / count
    width = len(mean)
    spread = np.zeros((width, width))
    for rows in features:
        centred = rows - mean
        spread += centred.T @ centred
    axes = np.linalg.eigh(spread)[1][:, ::-1][:, :3]
    axes = axes * np.sign(axes[np.abs(axes).argmax(axis=0), np.arange(axes.shape[1])])
    placed = [(rows - mean) @ axes for rows in features]
    low, high = np.percentile(np.concatenate(placed), PERCENTILES, axis=0)
    shares = [np.clip((rows - low) / np.maximum(high - low, 1e-12), 0, 1) for rows in placed]
    missing = 3 - axes.shape[1]
    return [linear(np.pad(rows, ((0, 0), (0, missing)), constant_values=0.5)) for rows in shares]
