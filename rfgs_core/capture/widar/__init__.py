# SPDX-License-Identifier: Apache-2.0
"""Widar 3.0 (Zheng et al. 2019): gestures of 17 people before six Intel 5300 receivers."""

from __future__ import annotations

from rfgs_core.capture.widar.recording import Recording, layout_of, read_bvp, read_take
from rfgs_core.capture.widar.release import Release, Take, choose, parse_name, scan
from rfgs_core.capture.widar.splits import Split, split

__all__ = [
    "Recording",
    "Release",
    "Split",
    "Take",
    "choose",
    "layout_of",
    "parse_name",
    "read_bvp",
    "read_take",
    "scan",
    "split",
]
