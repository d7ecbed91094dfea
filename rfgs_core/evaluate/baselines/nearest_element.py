# SPDX-License-Identifier: Apache-2.0
"""The nearest measured value: element of the same array, subcarrier, or device pair."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.baselines.interpolation import interpolating_baseline
from rfgs_core.evaluate.evidence import BaselineResult, Evidence


def nearest(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Value at the known coordinate nearest to each wanted one, the lower of equals."""
    distance = np.linalg.norm(wanted[:, None] - known[None], axis=-1)
    return values[distance.argmin(axis=1)]


def baseline(evidence: Evidence) -> BaselineResult:
    """Copies the nearest measured element of the same array, subcarrier and device pair."""
    return interpolating_baseline(evidence, nearest, None)
