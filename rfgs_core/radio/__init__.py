# SPDX-License-Identifier: Apache-2.0
"""Radios: presets, antenna layouts, materials and what a scene must satisfy for them."""

from __future__ import annotations

from rfgs_core.radio.layout import DevicePose, Layout, devices_at, layout
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.presets import PRESETS, Radio, preset
from rfgs_core.radio.samples import FrameSamples, frame_samples, pose_span_s

__all__ = [
    "PRESETS",
    "DevicePose",
    "FrameSamples",
    "Layout",
    "Radio",
    "devices_at",
    "frame_samples",
    "layout",
    "place_devices",
    "pose_span_s",
    "preset",
]
