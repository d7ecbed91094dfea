# SPDX-License-Identifier: Apache-2.0
"""The study: scenes x conditions x radios x seeds, each trained and held against its baselines."""

from __future__ import annotations

from rfgs_core.study.cases import CONDITIONS, RADIOS, SCENES, Case, Condition, cases
from rfgs_core.study.summary import summarise
from rfgs_core.study.table import study_table

__all__ = [
    "CONDITIONS",
    "RADIOS",
    "SCENES",
    "Case",
    "Condition",
    "cases",
    "study_table",
    "summarise",
]
