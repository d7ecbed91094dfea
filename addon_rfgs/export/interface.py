# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import RFGS_OT_export_bundle, RFGS_OT_render_groundtruth
from .panel import RFGS_PT_dataset

CLASSES = (RFGS_OT_export_bundle, RFGS_OT_render_groundtruth, RFGS_PT_dataset)
