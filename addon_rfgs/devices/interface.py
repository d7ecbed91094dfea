# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import (
    RFGS_OT_add_device,
    RFGS_OT_duplicate_device,
    RFGS_OT_match_devices,
    RFGS_OT_mirror_device,
    RFGS_OT_place_radio,
    RFGS_OT_remove_device,
)
from .panel import RFGS_PT_devices, RFGS_PT_object, RFGS_UL_devices

CLASSES = (
    RFGS_OT_add_device,
    RFGS_OT_place_radio,
    RFGS_OT_duplicate_device,
    RFGS_OT_mirror_device,
    RFGS_OT_remove_device,
    RFGS_OT_match_devices,
    RFGS_UL_devices,
    RFGS_PT_devices,
    RFGS_PT_object,
)
