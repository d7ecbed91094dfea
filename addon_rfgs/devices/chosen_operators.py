# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons for chosen radio devices: copy, mirror, remove, and make the others alike."""

from __future__ import annotations

import bpy
import mathutils

from ..command import Command
from ..errors import AddonError
from ..reporting import Progress, Undoable
from . import authoring, empties

_AXES = [("X", "X", "Across the plane of constant X"), ("Y", "Y", "Across that of constant Y")]


def _device_name() -> bpy.types.StringProperty:
    return bpy.props.StringProperty(
        name="Device",
        description="Name of the device; empty takes those that are selected",
        options={"SKIP_SAVE"},
    )


def _chosen(context: bpy.types.Context, name: str) -> list[bpy.types.Object]:
    """The device of a name, else the selected ones.

    Raises:
        AddonError: There is none.
    """
    if name:
        return [empties.named_device(context.scene, name)]
    found = [item for item in empties.devices(context.scene) if item.select_get()]
    if not found:
        raise AddonError("no radio device is selected")
    return found


class RFGS_OT_duplicate_device(Undoable, bpy.types.Operator):
    """Copy radio devices in place, with their radio."""

    bl_label = "Duplicate Device"
    command = Command("devices duplicate", words={"device": "device"}, saves=True)

    device: _device_name()
    offset: bpy.props.FloatVectorProperty(
        name="Offset",
        description="From the device to its copy, along the scene's axes",
        default=(0.0, 0.0, 0.5),
        subtype="TRANSLATION",
        size=3,
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Copies what is chosen."""
        twins = [empties.duplicate(context.scene, item) for item in _chosen(context, self.device)]
        context.view_layer.update()
        for twin in twins:
            matrix = twin.matrix_world.copy()
            matrix.translation += mathutils.Vector(self.offset)
            twin.matrix_world = matrix
        empties.select(context, twins)
        return f"Added {', '.join(twin.name for twin in twins)}"


class RFGS_OT_mirror_device(Undoable, bpy.types.Operator):
    """Mirror radio devices at the middle of the scene's bounds."""

    bl_label = "Mirror Device"
    command = Command(
        "devices mirror",
        words={"device": "device"},
        needs=("axis",),
        means={"--move": {"copy": False}},
        saves=True,
    )

    device: _device_name()
    axis: bpy.props.EnumProperty(
        name="Axis", description="Coordinate that changes its sign", items=_AXES
    )
    copy: bpy.props.BoolProperty(
        name="Copy", description="Mirror a copy and leave the device", default=True
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Mirrors what is chosen."""
        chosen = _chosen(context, self.device)
        twins = authoring.mirror_devices(
            context.scene, chosen, "XY".index(self.axis), copy=self.copy
        )
        empties.select(context, twins)
        return f"Mirrored {', '.join(item.name for item in twins)}"


class RFGS_OT_remove_device(Undoable, bpy.types.Operator):
    """Remove radio devices from the file."""

    bl_label = "Remove Device"
    command = Command("devices remove", words={"device": "device"}, saves=True)

    device: _device_name()

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Removes what is chosen."""
        chosen = _chosen(context, self.device)
        names = ", ".join(item.name for item in chosen)
        empties.remove(chosen)
        return f"Removed {names}"


class RFGS_OT_match_devices(Undoable, bpy.types.Operator):
    """Give every device of the scene's own radio the band, arrays and power of this one."""

    bl_label = "Copy Radio to All"
    command = Command("devices match", words={"device": "device"}, saves=True)

    device: _device_name()

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Copies the properties."""
        source, *more = _chosen(context, self.device)
        if more:
            raise AddonError("select the one device that the others shall be like")
        return f"Changed {authoring.match_devices(context.scene, source)} devices"
