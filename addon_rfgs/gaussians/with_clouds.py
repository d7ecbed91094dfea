# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that act on imported Gaussians."""

import bpy

from ..reporting import Reporting
from .clouds import COLLECTION


class WithClouds(Reporting):
    """Mixed into operators that need imported Gaussians."""

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether any were imported."""
        return COLLECTION in bpy.data.collections
