# SPDX-License-Identifier: Apache-2.0
"""What takes no model: nothing at all, the empty room, the nearest values and their lines."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.baselines.gaussian_process import krige, krige_level
from rfgs_core.evaluate.baselines.interpolation import fill, interpolating_baseline
from rfgs_core.evaluate.evidence import BaselineResult, Evidence


def zero(evidence: Evidence) -> BaselineResult:
    """Nothing moved and nothing arrives: 0 dB by definition, and no voxel predicted."""
    nothing = np.zeros(evidence.delta.shape, dtype=np.complex64)
    score = np.zeros(evidence.grid.shape, dtype=np.float32)
    return BaselineResult(score=score, delta=nothing, static=nothing)


def empty_room(evidence: Evidence) -> BaselineResult:
    """Predicts that nothing moved; hidden entries of the empty room are kriged."""
    return BaselineResult(
        score=np.zeros(evidence.grid.shape, dtype=np.float32),
        delta=np.zeros(evidence.delta.shape, dtype=np.complex64),
        static=fill(evidence.static, evidence, krige, krige_level),
    )


def nearest_element(evidence: Evidence) -> BaselineResult:
    """Copies the nearest measured element of the same array, subcarrier and device pair."""
    return interpolating_baseline(evidence, nearest, None)


def lines(evidence: Evidence) -> BaselineResult:
    """Extends lines along array columns and subcarriers; levels by inverse distance."""
    return interpolating_baseline(evidence, linear, inverse_distance)


def nearest(values: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Value at the known coordinate nearest to each wanted one, the lower of equals."""
    distance = np.linalg.norm(wanted[:, None] - known[None], axis=-1)
    return values[distance.argmin(axis=1)]


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
