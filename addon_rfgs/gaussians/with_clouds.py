# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that act on imported Gaussians."""

import bpy

from ..reporting import Undoable
from .clouds import clouds_here


class WithClouds(Undoable):
    """Mixed into operators that need imported Gaussians."""

    @classmethod
    def ready(cls, context: bpy.types.Context) -> bool:
        """Whether any were imported into this scene."""
        found = bool(clouds_here(context.scene))
        if not found:
            cls.poll_message_set("Import Gaussians into this scene first")
        return found
