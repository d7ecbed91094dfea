# SPDX-License-Identifier: Apache-2.0
"""Straight lines through the nearest two measured values."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.baselines.interpolation import interpolating_baseline
from rfgs_core.evaluate.evidence import BaselineResult, Evidence


def linear(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Linear inter- and extrapolation of complex values along one ascending coordinate."""
    x, at = known[:, 0], wanted[:, 0]
    if len(x) < 2:
        return np.repeat(values[:1], len(at), axis=0)
    left = np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2)
    share = ((at - x[left]) / (x[left + 1] - x[left]))[:, None]
    return (values[left] * (1.0 - share) + values[left + 1] * share).astype(values.dtype)


def inverse_distance(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Mean weighted with the inverse squared distance, for scattered device pairs."""
    distance = np.linalg.norm(wanted[:, None] - known[None], axis=-1)
    weight = 1.0 / np.maximum(distance, 1e-6) ** 2
    return weight @ values / weight.sum(axis=1, keepdims=True)


def baseline(evidence: Evidence) -> BaselineResult:
    """Extends lines along array columns and subcarriers; levels by inverse distance."""
    return interpolating_baseline(evidence, linear, inverse_distance)
