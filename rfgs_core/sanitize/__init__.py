# SPDX-License-Identifier: Apache-2.0
"""Sanitisation of measured channels: pure functions, each with its formula and source.

In the order that survives review: gain, rotations of the standard, null, pilot and centre
subcarriers, outliers, one clock; only then phases: slopes, products or ratios, Doppler, delay.
"""

from __future__ import annotations

from rfgs_core.sanitize.clock import common_clock, resample
from rfgs_core.sanitize.delays import windowed_profile
from rfgs_core.sanitize.doppler import doppler_band, doppler_spectrum, first_component
from rfgs_core.sanitize.gain import normalise_power, scale_intel5300, scale_to_rssi, undo_gain
from rfgs_core.sanitize.gaps import fill_gaps
from rfgs_core.sanitize.outliers import hampel
from rfgs_core.sanitize.phase import (
    remove_linear_phase,
    undo_quarter_turns,
    undo_rotations,
    unwrap,
)
from rfgs_core.sanitize.products import (
    adjust_amplitudes,
    conjugate_product,
    csi_ratio,
    reference_antenna,
)

__all__ = [
    "adjust_amplitudes", "common_clock", "conjugate_product", "csi_ratio", "doppler_band",
    "doppler_spectrum", "fill_gaps", "first_component", "hampel", "normalise_power",
    "reference_antenna", "remove_linear_phase", "resample", "scale_intel5300", "scale_to_rssi",
    "undo_gain", "undo_quarter_turns", "undo_rotations", "unwrap", "windowed_profile",
]  # fmt: skip
