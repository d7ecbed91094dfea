# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import RFGS_OT_show_csi
from .panel import RFGS_PT_channels

CLASSES = (RFGS_OT_show_csi, RFGS_PT_channels)
