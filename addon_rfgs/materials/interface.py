# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .operators import (
    RFGS_OT_apply_guesses,
    RFGS_OT_assign_material,
    RFGS_OT_color_materials,
    RFGS_OT_guess_materials,
)
from .panel import RFGS_PT_guesses, RFGS_PT_material, RFGS_UL_guesses

CLASSES = (
    RFGS_OT_assign_material,
    RFGS_OT_guess_materials,
    RFGS_OT_apply_guesses,
    RFGS_OT_color_materials,
    RFGS_UL_guesses,
    RFGS_PT_material,
    RFGS_PT_guesses,
)
