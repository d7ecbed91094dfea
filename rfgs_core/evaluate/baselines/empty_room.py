# SPDX-License-Identifier: Apache-2.0
"""The room without anybody: csi − csi_static is zero, csi is the kriged empty room."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.baselines.gaussian_process import krige, krige_level
from rfgs_core.evaluate.baselines.interpolation import fill
from rfgs_core.evaluate.evidence import BaselineResult, Evidence


def baseline(evidence: Evidence) -> BaselineResult:
    """Predicts that nothing moved; hidden entries of the empty room are kriged."""
    return BaselineResult(
        score=np.zeros(evidence.grid.shape, dtype=np.float32),
        delta=np.zeros(evidence.delta.shape, dtype=np.complex64),
        static=fill(evidence.static, evidence, krige, krige_level),
    )
