# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of this add-on in the data of a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

_NAME = "rfgs"


def remove_properties() -> int:
    """Removes them from everything.

    Returns:
        From how many things.
    """
    return sum(_remove(group) for item in _everything() for group in _groups(item))


def prune_properties() -> None:
    """Removes those that say nothing: Blender makes empty ones where a panel merely looks."""
    for item in _everything():
        for group in _groups(item):
            if _NAME in group.keys() and not _says(group[_NAME]):
                _remove(group)


def _everything() -> Iterator[bpy.types.ID]:
    for spec in bpy.data.bl_rna.properties:
        if spec.type == "COLLECTION":
            yield from getattr(bpy.data, spec.identifier)


def _groups(item: bpy.types.ID) -> list[Any]:
    """Where Blender may keep properties of add-ons.

    They have had a place of their own since 5.0; before, they were among the custom properties.
    """
    system = getattr(item, "bl_system_properties_get", lambda **_: None)(do_create=False)
    return [item] if system is None else [item, system]


def _remove(group: Any) -> bool:
    if _NAME not in group.keys():
        return False
    del group[_NAME]
    return True


def _says(value: Any) -> bool:
    """Whether anything was ever set in a group."""
    if not hasattr(value, "keys"):
        return True
    return any(_says(value[name]) for name in value.keys())
