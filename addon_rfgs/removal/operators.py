# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that leaves a file as if this add-on had never been there."""

from typing import Any

import bpy

from ..channels.image import remove_images
from ..command import Command
from ..coverage.surface import clear_coverage
from ..devices.empties import COLLECTION as DEVICES
from ..gaussians.clouds import COLLECTION as CLOUDS
from ..gaussians.nodes import GROUP
from ..gaussians.viewpoint import MADE
from ..materials.coloring import restore
from ..ownership import collections_of, drop_empty
from ..paths.curves import COLLECTION as PATHS
from ..paths.curves import clear_paths
from ..reporting import Progress, Undoable
from .stored import remove_properties


class RFGS_OT_remove_data(Undoable, bpy.types.Operator):
    """Remove devices, Gaussians, ray paths, coverage and every RF-GS setting from this file."""

    bl_label = "Remove RF-GS Data from File"
    command = Command("remove-data", saves=True)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks first."""
        return context.window_manager.invoke_confirm(self, event)

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes everything."""
        objects, properties = remove_data()
        return f"Removed {objects} objects, and RF-GS settings of {properties} data-blocks"


def remove_data() -> tuple[int, int]:
    """Removes devices, Gaussians, paths, coverage, images of channels and all our properties.

    What a user put into collections of ours stays, and so do Empties of their own that were made
    devices: they lose their radio.

    Returns:
        How many objects went, and how many things lost a property.
    """
    count = clear_paths()[0] + clear_coverage()
    restore()
    remove_images()
    for item in _objects():
        _remove_object(item)
        count += 1
    for name in (DEVICES, CLOUDS, PATHS):
        drop_empty(name)
    for rows in (bpy.data.node_groups, bpy.data.materials):
        for row in [row for row in rows if row.name.startswith(GROUP)]:
            if not row.users:
                rows.remove(row)
    return count, remove_properties()


def _objects() -> list[bpy.types.Object]:
    found = [item for item in bpy.data.objects if GROUP in item.modifiers]
    for collection in collections_of(DEVICES):
        found += [item for item in collection.objects if item.rfgs.role != "NONE"]
    found += [item for item in bpy.data.objects if item.get(MADE)]
    boxes = {scene.rfgs.gaussians.crop_box for scene in bpy.data.scenes}
    return found + [box for box in boxes if box is not None and box.name.startswith("RFGS ")]


def _remove_object(item: bpy.types.Object) -> None:
    motion = item.animation_data
    left: list[tuple[Any, Any]] = [(bpy.data.actions, motion.action if motion else None)]
    if isinstance(item.data, bpy.types.Mesh):
        left.append((bpy.data.meshes, item.data))
    bpy.data.objects.remove(item)
    for rows, row in left:
        if row is not None and not row.users:
            rows.remove(row)
