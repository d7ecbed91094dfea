# SPDX-License-Identifier: Apache-2.0
"""Back-projection: the classical picture of what reflects, and the method's starting point.

Coherent within a device pair, incoherent between pairs. Four ways of joining the pairs are
all reported; `matched_filter` itself is the one that did best on another scene (a person in an
empty room, single bounces): the log-mean over pairs of different devices where there are
any, else the sum over all pairs.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32

from rfgs_core.evaluate.evidence import BaselineResult, Evidence

WHY_NO_CHANNEL = "a picture of power; it predicts no channel"


def combine(
    power: Float[np.ndarray, "pair ..."], use: Bool[np.ndarray, "pair"], log_mean: bool
) -> Float[np.ndarray, "..."]:
    """Sum or geometric mean over the used pairs.

    Each pair is scaled to the same mean first for the sum: otherwise the pair that stands
    closest to the person would decide alone.
    """
    chosen = power[use].astype(np.float64)
    level = chosen.reshape(len(chosen), -1).mean(axis=1)
    chosen = chosen / np.maximum(level, 1e-300).reshape(-1, *[1] * (chosen.ndim - 1))
    if log_mean:
        return np.exp(np.mean(np.log(np.maximum(chosen, 1e-12)), axis=0))
    return chosen.sum(axis=0)


def variant(evidence: Evidence, different_only: bool, log_mean: bool) -> BaselineResult:
    """One way of joining the pairs."""
    maps = evidence.maps
    use = maps.different if different_only else np.ones(len(maps.pairs), dtype=bool)
    if not use.any():
        return BaselineResult(reason="this radio measures no links between different devices")
    score = maps.on_grid(combine(maps.power, use, log_mean))
    return BaselineResult(score=score, reason=WHY_NO_CHANNEL)


@lru_cache(maxsize=1)
def default_score(evidence: Evidence) -> Float32[np.ndarray, "x y z"]:
    """Score of the default variant, kept for the method that asks next; not to be changed."""
    different = bool(evidence.maps.different.any())
    score = variant(evidence, different, different).score
    assert score is not None
    score = score.astype(np.float32)
    score.flags.writeable = False
    return score


def baseline(evidence: Evidence) -> BaselineResult:
    """The default variant."""
    return BaselineResult(score=default_score(evidence), reason=WHY_NO_CHANNEL)
