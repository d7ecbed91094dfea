# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the devices panel."""

from __future__ import annotations

import bpy

from .empties import is_device


def _active(_self: bpy.types.PropertyGroup) -> int:
    item = bpy.context.view_layer.objects.active
    return bpy.data.objects.find(item.name) if item is not None and is_device(item) else -1


def _activate(_self: bpy.types.PropertyGroup, index: int) -> None:
    """Selects the device that was clicked, and nothing else."""
    layer = bpy.context.view_layer
    item = bpy.data.objects[index]
    if item.name not in layer.objects:
        return
    for other in layer.objects:
        other.select_set(other == item)
    layer.objects.active = item


class RFGS_PG_devices(bpy.types.PropertyGroup):
    """How devices are listed and drawn."""

    active: bpy.props.IntProperty(
        name="Device",
        description="The active radio device; choosing another selects it",
        get=_active,
        set=_activate,
    )
    overlay: bpy.props.BoolProperty(
        name="Show Antennas",
        description="Draw antenna elements, boresight and names of devices in the 3D view",
        default=True,
    )
    names: bpy.props.BoolProperty(
        name="Names", description="Write the name beside each device", default=True
    )
