# SPDX-License-Identifier: Apache-2.0
"""Powers as levels."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def decibels(power: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Powers in dB, at least -300, of the same shape."""
    return 10.0 * np.log10(np.maximum(power, 1e-30))
