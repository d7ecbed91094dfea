# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import RFGS_OT_check_scene, RFGS_OT_repair_finding, RFGS_OT_select_finding
from .panel import RFGS_PT_check, RFGS_UL_findings

CLASSES = (
    RFGS_OT_check_scene,
    RFGS_OT_select_finding,
    RFGS_OT_repair_finding,
    RFGS_UL_findings,
    RFGS_PT_check,
)
