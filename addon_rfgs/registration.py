# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the classes of every folder to Blender and takes them away again."""

import bpy

from .devices.interface import CLASSES as DEVICES
from .export.interface import CLASSES as EXPORT
from .gaussians.interface import CLASSES as GAUSSIANS
from .jobs.interface import CLASSES as JOBS
from .materials.interface import CLASSES as MATERIALS
from .paths.interface import CLASSES as PATHS
from .removal.interface import CLASSES as REMOVAL

#: Panels appear in this order.
_CLASSES = (*DEVICES, *MATERIALS, *EXPORT, *JOBS, *GAUSSIANS, *PATHS, *REMOVAL)


def register() -> None:
    """Adds the operators and panels."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the operators and panels."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
