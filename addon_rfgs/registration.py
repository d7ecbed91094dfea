# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the classes of every folder to Blender and takes them away again."""

import inspect

import bpy

from .channels.interface import CLASSES as CHANNELS
from .check.interface import CLASSES as CHECK
from .devices.interface import CLASSES as DEVICES
from .export.interface import CLASSES as EXPORT
from .gaussians.interface import CLASSES as GAUSSIANS
from .jobs.interface import CLASSES as JOBS
from .materials.interface import CLASSES as MATERIALS
from .paths.interface import CLASSES as PATHS
from .removal.interface import CLASSES as REMOVAL

#: Panels appear in this order.
_CLASSES = (*DEVICES, *MATERIALS, *CHECK, *EXPORT, *JOBS, *GAUSSIANS, *CHANNELS, *PATHS, *REMOVAL)


def register() -> None:
    """Adds the operators and panels."""
    for cls in _CLASSES:
        if issubclass(cls, bpy.types.Operator) and "bl_description" not in vars(cls):
            cls.bl_description = tooltip(cls.__doc__ or "")
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the operators and panels."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)


def tooltip(docstring: str) -> str:
    """A docstring as Blender wants it: a line per paragraph; the last full stop is Blender's."""
    paragraphs = inspect.cleandoc(docstring).split("\n\n")
    return "\n".join(" ".join(text.split()) for text in paragraphs).removesuffix(".")
