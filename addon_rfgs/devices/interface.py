# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels of this folder, in the order they are registered."""

from .panel import RFGS_PT_object

CLASSES = (RFGS_PT_object,)
