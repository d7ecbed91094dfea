# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of radio devices: the list of all, and what the active object is to the radio."""

from __future__ import annotations

from typing import Any

import bpy

from ..steps import PartOfStep, Step
from ..tab import paragraph
from .empties import OWN_RADIOS, is_device
from .fields import draw_fields

_ICONS = {
    "TRANSMITTER": "TRIA_RIGHT",
    "RECEIVER": "TRIA_LEFT",
    "ACCESS_POINT": "ARROW_LEFTRIGHT",
    "NONE": "BLANK1",
}


#: Kinds of objects that scatter, an Empty by what it makes copies of.
_MEANINGFUL = {"MESH", "CURVE", "SURFACE", "FONT", "META", "EMPTY"}


class RFGS_UL_devices(bpy.types.UIList):
    """Radio devices among all objects of the file."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: Any,
        item: bpy.types.Object,
        _icon: int,
        _active_data: Any,
        _active_property: str,
    ) -> None:
        """One device: role, name (double click to rename), radio."""
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False, icon=_ICONS[item.rfgs.role])
        side = row.row()
        side.alignment = "RIGHT"
        side.label(text=item.rfgs.radio)

    def filter_items(
        self, context: bpy.types.Context, data: Any, name: str
    ) -> tuple[list[int], list[int]]:
        """Shows devices of this scene by name, and of these what is searched for."""
        items = getattr(data, name)
        wanted = self.filter_name.lower()
        here = context.scene.objects
        shown = [
            self.bitflag_filter_item
            if is_device(item) and item.name in here and wanted in item.name.lower()
            else 0
            for item in items
        ]
        return shown, bpy.types.UI_UL_list.sort_items_by_name(items, "name")


class RFGS_PT_devices(Step, bpy.types.Panel):
    """Radio devices of the scene."""

    bl_label = "1 Radios"
    step, icon = "radios", "OUTLINER_OB_EMPTY"

    @classmethod
    def taken(cls, scene: bpy.types.Scene) -> str:
        """How many there are, unless one of them is active: then its settings are looked at."""
        active = bpy.context.object
        count = sum(is_device(item) for item in scene.objects)
        if not count or (active is not None and is_device(active)):
            return ""
        return f"{count} device{'' if count == 1 else 's'}"

    def draw_step(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows buttons that add, the list, and buttons for what is selected."""
        settings = context.scene.rfgs.devices
        row = layout.row(align=True)
        for role, text in (("TRANSMITTER", "TX"), ("RECEIVER", "RX"), ("ACCESS_POINT", "AP")):
            row.operator("rfgs.add_device", text=text, icon=_ICONS[role]).role = role
        row = layout.row(align=True)
        row.operator_menu_enum("rfgs.place_radio", "radio", text="Place Preset", icon="ADD")
        row = layout.row(align=True)
        row.operator("rfgs.import_devices", text="Of a Dataset", icon="IMPORT")
        row.operator("rfgs.import_capture", text="Of a Capture", icon="FILE_NEW")
        there = any(is_device(item) for item in context.scene.objects)
        if not there:
            paragraph(layout, "None yet: Generate takes the places of a preset", "INFO")
        row = layout.row()
        shown = ("RFGS_UL_devices", "", bpy.data, "objects", settings, "active")
        row.template_list(*shown, rows=4 if there else 2)
        side = row.column(align=True)
        side.operator("rfgs.remove_device", text="", icon="REMOVE")
        side.operator("rfgs.duplicate_device", text="", icon="DUPLICATE")
        if there:
            side.separator()
            side.operator_menu_enum("rfgs.mirror_device", "axis", text="", icon="MOD_MIRROR")
        row = layout.row(align=True)
        row.prop(settings, "overlay", text="Antennas", toggle=True, icon="OVERLAY")
        part = row.row(align=True)
        part.active = settings.overlay
        part.prop(settings, "names", toggle=True)


class RFGS_PT_device(PartOfStep, bpy.types.Panel):
    """The radio of the active Empty."""

    bl_label = "Active Device"
    bl_parent_id = "RFGS_PT_devices"
    bl_options = set()  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the active object can be a device."""
        there = context.object is not None and context.object.type == "EMPTY"
        return there and super().poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Shows its role, and what applies to it."""
        layout, item = self.columns(), context.object
        layout.prop(item.rfgs, "role")
        if is_device(item):
            layout.prop(item.rfgs, "radio")
            if item.rfgs.radio in OWN_RADIOS:
                draw_fields(layout, item.rfgs.rf, item.rfgs.role)
                layout.operator("rfgs.match_devices", icon="PASTEDOWN").device = item.name


class RFGS_PT_object(PartOfStep, bpy.types.Panel):
    """What the active object counts as."""

    bl_label = "Active Object"
    bl_parent_id = "RFGS_PT_devices"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the active object can scatter."""
        item = context.object
        there = item is not None and item.type in _MEANINGFUL and not is_device(item)
        return there and super().poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Shows class, instance and surface."""
        layout, item = self.columns(), context.object
        layout.prop(item.rfgs, "object_class")
        layout.prop(item.rfgs, "instance", placeholder="the object itself")
        self.automatic(layout, item.rfgs, "surface_m2", "from its class")
