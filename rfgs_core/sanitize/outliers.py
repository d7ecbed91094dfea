# SPDX-License-Identifier: Apache-2.0
"""Outliers over time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float

#: Standard deviations of a normal distribution in one median absolute deviation.
MAD_TO_SIGMA = 1.4826


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
    from scipy.ndimage import median_filter

    level = np.abs(values) if np.iscomplexobj(values) else np.asarray(values, np.float64)
    size = (2 * half_window + 1, *[1] * (values.ndim - 1))
    median = median_filter(level, size=size, mode="nearest")
    deviation = median_filter(np.abs(level - median), size=size, mode="nearest")
    outlying = np.abs(level - median) > sigmas * MAD_TO_SIGMA * deviation
    if not np.iscomplexobj(values):
        return np.where(outlying, median, values), outlying
    replaced = median * np.exp(1j * np.angle(values))
    return np.where(outlying, replaced, values).astype(values.dtype), outlying
