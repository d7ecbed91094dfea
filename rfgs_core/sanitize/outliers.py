# SPDX-License-Identifier: Apache-2.0
"""Outliers over time."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Complex, Float

#: Standard deviations of a normal distribution in one median absolute deviation.
MAD_TO_SIGMA = 1.4826
#: Values of windows that are looked at together.
_BLOCK = 2**22


def hampel(
    values: Complex[np.ndarray, "time *link"] | Float[np.ndarray, "time *link"],
    half_window: int = 5,
    sigmas: float = 3.0,
) -> tuple[
    Complex[np.ndarray, "time *link"] | Float[np.ndarray, "time *link"],
    Bool[np.ndarray, "time *link"],
]:
    """Replaces amplitudes that are far from the median of their neighbours in time by it.

    |x − m| > n · 1.4826 · MAD with m and MAD the median and the median absolute deviation over
    2 w + 1 packets (Hampel 1974; Davies and Gather 1993). Medians see the input, not what was
    replaced before. Complex values keep their phases.

    Args:
        values: Series.
        half_window: w, packets on either side.
        sigmas: n.

    Returns:
        A copy, and where it was changed.
    """
    level = np.abs(values) if np.iscomplexobj(values) else np.asarray(values, np.float64)
    median, deviation = np.zeros_like(level), np.zeros_like(level)
    ends = [(half_window, half_window), *[(0, 0)] * (values.ndim - 1)]
    padded = np.pad(level, ends, mode="edge")
    # The deviation of every window is from its own median, so windows are written out, some at
    # a time.
    step = max(1, _BLOCK // max(1, (2 * half_window + 1) * math.prod(values.shape[1:])))
    for first in range(0, len(level), step):
        rows = padded[first : first + step + 2 * half_window]
        around = np.lib.stride_tricks.sliding_window_view(rows, 2 * half_window + 1, axis=0)
        part = slice(first, first + len(around))
        median[part] = np.median(around, axis=-1)
        deviation[part] = np.median(np.abs(around - median[part, ..., None]), axis=-1)
    outlying = np.abs(level - median) > sigmas * MAD_TO_SIGMA * deviation
    if not np.iscomplexobj(values):
        return np.where(outlying, median, values), outlying
    replaced = median * np.exp(1j * np.angle(values))
    return np.where(outlying, replaced, values).astype(values.dtype), outlying
