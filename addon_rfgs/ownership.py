# SPDX-License-Identifier: GPL-3.0-or-later
"""What belongs to the open file, and to which of its scenes."""

from __future__ import annotations

import re

import bpy

from .errors import AddonError

#: How the names of all collections begin that the add-on makes.
_BEGINS = "RF-GS "


def need_own(block: bpy.types.ID) -> None:
    """Refuses to change what comes from another file: the change would not be saved.

    Raises:
        AddonError: It is linked.
    """
    if block.library is not None:
        kind = block.bl_rna.name.lower()
        raise AddonError(
            f"{kind} {block.name!r} is linked from {block.library.filepath}; change it there"
        )


def own_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """The scene's collection of a name; made if it has none, as another scene's shows its own.

    Raises:
        AddonError: The scene is linked from another file.
    """
    need_own(scene)
    found = found_collection(scene, name)
    if found is None:
        found = bpy.data.collections.new(name)
        scene.collection.children.link(found)
    return found


def found_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection | None:
    """The scene's collection of a name, wherever a user has moved it; None if it has none."""
    here = (row for row in scene.collection.children_recursive if is_own(row, name))
    return next(here, None)


def collections_of(name: str) -> list[bpy.types.Collection]:
    """Those of all scenes."""
    return [row for row in bpy.data.collections if is_own(row, name)]


def is_own(collection: bpy.types.Collection, name: str) -> bool:
    """Whether a collection is one of a name; Blender numbers the second, and so on."""
    fits = re.fullmatch(re.escape(name) + r"(\.\d+)?", collection.name)
    return fits is not None and collection.library is None


def is_shown_by_us(item: bpy.types.Object) -> bool:
    """Whether an object stands in collections of the add-on alone: a cloud, a path, a device."""
    homes = item.users_collection
    return bool(homes) and all(home.name.startswith(_BEGINS) for home in homes)


def drop_empty(name: str) -> None:
    """Removes collections of a name in which nothing is left."""
    for collection in collections_of(name):
        if not collection.objects and not collection.children:
            bpy.data.collections.remove(collection)
