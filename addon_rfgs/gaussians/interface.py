# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import RFGS_OT_import_gaussians, RFGS_OT_update_display
from .panel import RFGS_PT_gaussians

CLASSES = (RFGS_OT_import_gaussians, RFGS_OT_update_display, RFGS_PT_gaussians)
