# SPDX-License-Identifier: Apache-2.0
"""Nothing moved and nothing arrives: 0 dB by definition, and no voxel predicted."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.evidence import BaselineResult, Evidence


def baseline(evidence: Evidence) -> BaselineResult:
    """A channel of zeros and an empty map."""
    nothing = np.zeros(evidence.delta.shape, dtype=np.complex64)
    score = np.zeros(evidence.grid.shape, dtype=np.float32)
    return BaselineResult(score=score, delta=nothing, static=nothing)
