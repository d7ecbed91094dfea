# SPDX-License-Identifier: Apache-2.0
"""Encoders: what the channel says about a point in space."""

from __future__ import annotations

from rfgs_core.encode.matched_filter import matched_filter_features, matched_filter_map

__all__ = ["matched_filter_features", "matched_filter_map"]
