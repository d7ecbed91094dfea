# SPDX-License-Identifier: Apache-2.0
"""Impairments of real radios: drawn with a seed, applied beside clean channels, undone exactly."""

from __future__ import annotations

from rfgs_core.radio.impairments.apply import impair, restore
from rfgs_core.radio.impairments.draw import Draw, draw_impairments
from rfgs_core.radio.impairments.receiver import amplitude
from rfgs_core.radio.impairments.settings import (
    IMPAIRMENT_PRESETS,
    Impairments,
    impairments_from_json,
    read_impairments,
)

__all__ = [
    "IMPAIRMENT_PRESETS",
    "Draw",
    "Impairments",
    "amplitude",
    "draw_impairments",
    "impair",
    "impairments_from_json",
    "read_impairments",
    "restore",
]
