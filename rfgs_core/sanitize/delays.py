# SPDX-License-Identifier: Apache-2.0
"""Delay profiles on the true grid of subcarriers."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float64, Int

from rfgs_core.radio.delay import delay_transform


def windowed_profile(
    values: Complex[np.ndarray, "*link bin"],
    index: Int[np.ndarray, "bin"],
    spacing_hz: float,
    valid: Bool[np.ndarray, "bin"] | None = None,
    oversample: int = 4,
) -> tuple[Float64[np.ndarray, "delay"], Complex[np.ndarray, "*link delay"]]:
    """Impulse response with a Hamming window along subcarriers, h(τ) = Σ w_k H_k e^{j2πkΔfτ}/Σ w.

    Source: RF-GS, section 3.6. The window and the transform run over the true numbers k, missing
    subcarriers count as zero; a window over the reported ones alone would bend the grid.

    Args:
        values: Channels.
        index: Number of each subcarrier, ascending.
        spacing_hz: Distance of neighbouring numbers [Hz].
        valid: Subcarriers that count; all if None.
        oversample: Samples per 1/bandwidth.

    Returns:
        Delays [s] from 0 to 1/Δf, and the response; one path of amplitude a peaks at a.
    """
    span = int(index[-1] - index[0]) + 1
    step = int(np.gcd.reduce(np.diff(index))) if len(index) > 1 else 1
    count = (span - 1) // step + 1
    place = (index - index[0]) // step
    window = np.hamming(count)[place] if count > 1 else np.ones(1)
    window = window * (1.0 if valid is None else valid)
    size = oversample * count
    weighed = values.astype(np.complex128) * window / max(window.sum(), 1e-300)
    profile = delay_transform(weighed, size, place) * size
    delay_s = np.arange(size) / (size * step * spacing_hz)
    # The first bin is not the centre: its offset turns every delay by a known phase.
    return delay_s, profile * np.exp(2j * np.pi * index[0] * spacing_hz * delay_s)
