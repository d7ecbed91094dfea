# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import RFGS_OT_remove_data
from .panel import RFGS_PT_file

CLASSES = (RFGS_OT_remove_data, RFGS_PT_file)
