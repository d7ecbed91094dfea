# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that add and place radio devices."""

from __future__ import annotations

from typing import Any

import bpy
import mathutils
import numpy as np

from ..command import Command
from ..errors import AddonError
from ..reporting import Progress, Undoable
from ..scene.bounds import MARGIN_M
from ..scene.frames import named, unit_scale
from ..scene.override_file import boresight
from ..tables import MOST_ELEMENTS, RADIO_DEFAULTS, RADIOS
from . import authoring, empties
from .fields import draw_fields
from .layout import wavelength_m
from .properties import RadioFields, search_radios

ROLES = [
    ("TRANSMITTER", "Transmitter", "Only transmits", "TRIA_RIGHT", 0),
    ("RECEIVER", "Receiver", "Only receives", "TRIA_LEFT", 1),
    ("ACCESS_POINT", "Access Point", "Transmits and receives", "ARROW_LEFTRIGHT", 2),
]


def _refuse_senseless(values: dict[str, Any]) -> None:
    """Refuses bands and arrays that make no sense, and turns wavelengths into metres.

    Raises:
        AddonError: They make none.
    """
    band = {**RADIO_DEFAULTS, **(empties.alike(bpy.context.scene) or {})}
    if "freq_min_ghz" in values:
        low, high = values["freq_min_ghz"], values["freq_max_ghz"]
        if low >= high:
            raise AddonError(f"--band-ghz: expected FROM < TO, got {low:g} {high:g}")
        band |= {"freq_min_hz": low * 1e9, "freq_max_hz": high * 1e9}
    for array in ("tx", "rx"):
        rows, cols = (values.get(f"{array}_{name}", 1) for name in ("rows", "cols"))
        if rows * cols > MOST_ELEMENTS:
            raise AddonError(f"--{array}: {rows}x{cols} is more than {MOST_ELEMENTS} elements")
        # Scripts cannot call the setter of an operator's property.
        wavelengths = values.pop(f"{array}_spacing_wavelengths", None)
        if wavelengths is not None:
            values[f"{array}_spacing_m"] = wavelengths * wavelength_m(band)


class RFGS_OT_add_device(RadioFields, Undoable, bpy.types.Operator):
    """Add an Empty that transmits, receives or does both.

    It looks along its local X; new devices of the scene's own radio are like those that are there
    """

    bl_label = "Add Radio Device"
    command = Command(
        "devices add",
        words={
            "role": "role",
            "location": "--at",
            "device": "--name",
            "num_subcarriers": "--subcarriers",
        },
        needs=("location",),
        together={
            "--band-ghz FROM TO": ("freq_min_ghz", "freq_max_ghz"),
            "--tx ROWSxCOLS": ("tx_rows", "tx_cols"),
            "--rx ROWSxCOLS": ("rx_rows", "rx_cols"),
        },
        prepare=_refuse_senseless,
        saves=True,
    )

    device: bpy.props.StringProperty(
        name="Name", description="Name of the device; empty: its role", options={"SKIP_SAVE"}
    )
    role: bpy.props.EnumProperty(
        name="Role", description="What the device does", items=ROLES, default="ACCESS_POINT"
    )
    radio: bpy.props.StringProperty(
        name="Radio",
        description="'scene' for the radio described below, 'any', or the name of a preset",
        default="scene",
        search=search_radios,
    )
    location: bpy.props.FloatVectorProperty(
        name="Location", description="Where the device stands", subtype="TRANSLATION", size=3
    )
    rotation: bpy.props.FloatVectorProperty(
        name="Rotation",
        description="How the device is turned; unturned it looks along X",
        subtype="EULER",
        size=3,
    )
    look_at: bpy.props.FloatVectorProperty(
        name="Look At",
        description="Point that the device looks at, in place of a rotation",
        subtype="TRANSLATION",
        size=3,
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Puts it at the 3D cursor, looking at the middle of what is there."""
        self.location = context.scene.cursor.location
        corners = [
            item.matrix_world @ mathutils.Vector(corner)
            for item in context.visible_objects
            if item.type == "MESH"
            for corner in item.bound_box
        ]
        if corners:
            middle = 0.5 * (np.min(corners, axis=0) + np.max(corners, axis=0))
            turn = boresight(tuple(self.location), (*middle[:2], self.location[2]))
            self.rotation = mathutils.Quaternion(turn).to_euler()
        fields = empties.alike(context.scene)
        if fields is not None:
            self.take(fields)
        return self.execute(context)

    def draw(self, _context: bpy.types.Context) -> None:
        """Shows what belongs to the role."""
        layout = self.layout
        layout.use_property_split = True
        for name in ("role", "radio", "location", "rotation"):
            layout.prop(self, name)
        if self.radio in empties.OWN_RADIOS:
            draw_fields(layout, self, self.role)

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Adds the Empty."""
        turn = mathutils.Euler(self.rotation).to_quaternion()
        if self.properties.is_property_set("look_at"):
            turn = mathutils.Quaternion(boresight(tuple(self.location), tuple(self.look_at)))
        place = mathutils.Matrix.Translation(
            mathutils.Vector(self.location) * unit_scale(context.scene)
        )
        fields = dict(empties.alike(context.scene) or {})
        fields.update(self._said())
        item = empties.add_device(
            context.scene,
            name=self.device or self.role.lower(),
            role=self.role,
            radio=self.radio,
            pose=np.array(place @ turn.to_matrix().to_4x4()),
            fields=fields,
        )
        empties.select(context, [item])
        return f"Added {item.name}"

    def _said(self) -> dict[str, object]:
        """Fields of the radio that somebody set."""
        row = self.row()
        spelt = {name: name.replace("_hz", "_ghz") for name in row}
        return {name: row[name] for name in row if self.properties.is_property_set(spelt[name])}


class RFGS_OT_place_radio(Undoable, bpy.types.Operator):
    """Place all devices of a preset in the scene, as a dataset without devices would have them.

    Devices of the same preset that are there already are replaced
    """

    bl_label = "Place Radio"
    command = Command(
        "devices preset",
        words={"radio": "radio", "objects": "--around"},
        means={"--around": {"around": "SELECTION"}},
        saves=True,
    )

    radio: bpy.props.EnumProperty(
        name="Radio",
        description="Which preset",
        items=[(name, name, text) for name, text in RADIOS.items()],
    )
    around: bpy.props.EnumProperty(
        name="Around",
        description="What the devices surround",
        items=[
            ("SCENE", "Scene", "The bounds of what radio sees"),
            ("SELECTION", "Selection", "A box around what is selected, wider by the margin"),
        ],
    )
    objects: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement,
        name="Objects",
        description="Names of objects to surround, in place of the selection",
        options={"SKIP_SAVE"},
    )
    margin_m: bpy.props.FloatProperty(
        name="Margin",
        description="Free space on each side of the selection [m]",
        default=MARGIN_M,
        min=0.0,
        soft_max=10.0,
    )
    keep: bpy.props.BoolProperty(
        name="Keep Others", description="Leave devices of this preset that are there already"
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Places the devices."""
        scene = context.scene
        chosen = [named(scene.objects, row.name, "object") for row in self.objects]
        chosen = chosen or list(context.selected_objects)
        bounds, meshes, room = authoring.scene_space(scene)
        if self.around == "SELECTION":
            bounds = authoring.around(scene, chosen, self.margin_m)
        placed = authoring.place_radio(scene, self.radio, (bounds, meshes, room), keep=self.keep)
        empties.select(context, placed)
        more = authoring.others_of(scene, self.radio)
        return f"Placed {len(placed)} devices of {self.radio}{more}"
