# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the classes of every folder to Blender and takes them away again."""

import inspect
from importlib import import_module

import bpy

from .removal.stored import prune_properties

#: Modules that hold classes for Blender; panels appear in this order.
_MODULES = (
    *("channels.settings", "check.settings", "coverage.settings", "devices.properties"),
    *("devices.settings", "export.settings", "gaussians.settings", "jobs.settings"),
    *("live.settings", "materials.properties", "paths.settings", "steps", "properties"),
    *("devices.operators", "devices.chosen_operators", "devices.captured", "devices.panel"),
    *("check.operators", "check.panel", "materials.operators", "materials.panel"),
    *("jobs.preferences", "jobs.operators", "jobs.panel", "export.operators", "export.panel"),
    *("gaussians.operators", "gaussians.file_menu", "gaussians.view_operators", "gaussians.panel"),
    *("live.operators", "live.panel"),
    *("channels.operators", "channels.panel", "paths.operators", "paths.panel"),
    *("coverage.operators", "coverage.panel"),
    *("removal.operators", "removal.panel"),
)

CLASSES = [
    item
    for module in (import_module(f"{__package__}.{name}") for name in _MODULES)
    for name, item in vars(module).items()
    if name.startswith("RFGS_") and item.__module__ == module.__name__
]


def register() -> None:
    """Adds them."""
    for cls in CLASSES:
        if issubclass(cls, bpy.types.Operator) and "bl_description" not in vars(cls):
            cls.bl_description = tooltip(cls.__doc__ or "")
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes them, and what they only looked at in the file."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    prune_properties()


def tooltip(docstring: str) -> str:
    """A docstring as Blender wants it: a line per paragraph; the last full stop is Blender's."""
    paragraphs = inspect.cleandoc(docstring).split("\n\n")
    return "\n".join(" ".join(text.split()) for text in paragraphs).removesuffix(".")
