# SPDX-License-Identifier: Apache-2.0
"""Encoders: what the channel says about a point in space."""

from __future__ import annotations

from rfgs_core.encode.matched_filter import (
    MATCHED_FILTER,
    PAPER_FILTER,
    MatchedFilter,
    matched_filter_map,
)
from rfgs_core.encode.protocol import Encoder, FrameChannel, unit_rms

__all__ = [
    "MATCHED_FILTER",
    "PAPER_FILTER",
    "Encoder",
    "FrameChannel",
    "MatchedFilter",
    "matched_filter_map",
    "unit_rms",
]
