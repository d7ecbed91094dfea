# SPDX-License-Identifier: Apache-2.0
"""The nearest measured value: element of the same array, tone, or device pair."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.baselines.interpolation import interpolating_control
from rfgs_core.evaluate.evidence import ControlResult, Evidence


def nearest(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Value at the known coordinate nearest to each wanted one, the lower of equals."""
    distance = np.linalg.norm(wanted[:, None] - known[None], axis=-1)
    return values[distance.argmin(axis=1)]


def control(evidence: Evidence) -> ControlResult:
    """Copies the nearest measured element of the same array, tone and device pair."""
    return interpolating_control(evidence, nearest, None)
