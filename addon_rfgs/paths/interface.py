# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import RFGS_OT_clear_paths, RFGS_OT_show_paths
from .panel import RFGS_PT_paths

CLASSES = (RFGS_OT_show_paths, RFGS_OT_clear_paths, RFGS_PT_paths)
