# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from . import panel
from .file_menu import RFGS_FH_gaussians, RFGS_OT_import_ply
from .operators import (
    RFGS_OT_compare_gaussians,
    RFGS_OT_export_gaussians,
    RFGS_OT_import_gaussians,
)
from .view_operators import (
    RFGS_OT_add_crop_box,
    RFGS_OT_color_solid_view,
    RFGS_OT_update_display,
)

CLASSES = (
    RFGS_OT_import_gaussians,
    RFGS_OT_import_ply,
    RFGS_FH_gaussians,
    RFGS_OT_export_gaussians,
    RFGS_OT_compare_gaussians,
    RFGS_OT_update_display,
    RFGS_OT_color_solid_view,
    RFGS_OT_add_crop_box,
    *panel.CLASSES,
)
