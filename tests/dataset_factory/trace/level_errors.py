# SPDX-License-Identifier: Apache-2.0
"""How far a channel is from the exact one."""

from __future__ import annotations

import numpy as np


def error_db(found: np.ndarray, exact: np.ndarray) -> float:
    """Power of the error over the power of the exact channel [dB]."""
    error = np.sum(np.abs(found - exact) ** 2) / np.sum(np.abs(exact) ** 2)
    return float(10 * np.log10(max(error, 1e-30)))
