# SPDX-License-Identifier: GPL-3.0-or-later
"""Radio devices as Empties of the open file: found, added, copied, mirrored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import bpy
import mathutils
import numpy as np

from ..errors import AddonError
from ..ownership import drop_empty, need_own, own_collection
from ..scene.frames import named, unit_scale
from ..tables import RADIO_FIELDS, RADIOS

#: Where new devices are kept.
COLLECTION = "RF-GS devices"
#: Radios whose properties stand at the Empties themselves.
OWN_RADIOS = ("scene", "any")
#: Half the length of the axes that Blender draws [m].
_AXES_M = 0.1


def is_device(item: bpy.types.Object) -> bool:
    """Whether an object has a role in a radio."""
    return item.rfgs.role != "NONE"


def devices(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Radio devices of a scene by name, as the dataset factory orders them."""
    return sorted((item for item in scene.objects if is_device(item)), key=lambda item: item.name)


def named_device(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The device of a name.

    Raises:
        AddonError: There is none; the message says which ones look like it.
    """
    return named({item.name: item for item in devices(scene)}, name, "radio device")


def radio_fields(item: bpy.types.Object) -> Mapping[str, Any]:
    """Fields of a device's radio: the preset's, else those that stand at the Empty."""
    radio = item.rfgs.radio.strip()
    return RADIO_FIELDS[radio] if radio in RADIO_FIELDS else item.rfgs.rf.row()


def pose_of(item: bpy.types.Object, unit: float) -> np.ndarray:
    """Rigid world_from_device [4, 4] in metres, `unit` being metres per Blender unit."""
    place, turn, _ = item.matrix_world.decompose()
    return np.array(mathutils.Matrix.LocRotScale(place * unit, turn, None), dtype=np.float64)


def set_pose(item: bpy.types.Object, pose: np.ndarray, unit: float) -> None:
    """Puts a device at a rigid world_from_device [4, 4] in metres; its own scale stays.

    Raises:
        AddonError: It is linked from another file.
    """
    need_own(item)
    matrix = mathutils.Matrix(pose.tolist())
    matrix.translation /= unit
    item.matrix_world = matrix @ mathutils.Matrix.Diagonal((*item.matrix_world.to_scale(), 1.0))


def known_radio(name: str) -> str:
    """A name that Empties may carry: a preset, `scene`, `any`, or that of a radio file.

    Raises:
        AddonError: It is empty.
    """
    if not name.strip():
        raise AddonError(f"radio: expected a name, as {', '.join((*OWN_RADIOS, *RADIOS))}")
    return name.strip()


def alike(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """Fields of the radio that the scene's Empties describe, None if there is none yet."""
    for item in devices(scene):
        if item.rfgs.radio.strip() in OWN_RADIOS:
            return item.rfgs.rf.row()
    return None


def add_device(
    scene: bpy.types.Scene,
    name: str,
    role: str,
    radio: str,
    pose: np.ndarray,
    fields: Mapping[str, Any],
) -> bpy.types.Object:
    """Adds an Empty that is a radio device.

    Args:
        scene: Scene it becomes part of.
        name: Wanted name; Blender appends a number where it is taken.
        role: `ACCESS_POINT`, `TRANSMITTER` or `RECEIVER`.
        radio: `scene`, `any`, or the name of a preset or a file's radio.
        pose: Rigid world_from_device [4, 4] in metres; local +X is the boresight.
        fields: Of the radio, as far as they differ from the defaults.
    """
    unit = unit_scale(scene)
    item = bpy.data.objects.new(name, None)
    item.empty_display_type, item.empty_display_size = "PLAIN_AXES", _AXES_M / unit
    item.rfgs.role, item.rfgs.radio = role, known_radio(radio)
    item.rfgs.rf.take(fields)
    own_collection(scene, COLLECTION).objects.link(item)
    set_pose(item, pose, unit)
    return item


def duplicate(scene: bpy.types.Scene, item: bpy.types.Object) -> bpy.types.Object:
    """A copy of a device in the same place and in the same collections.

    Of a device whose collections are all linked from another file the copy joins the scene's own.

    Raises:
        AddonError: The scene's own is of another file too; nothing has changed then.
    """
    homes = [row for row in item.users_collection if row.library is None]
    homes = homes or [own_collection(scene, COLLECTION)]
    twin = item.copy()
    for collection in homes:
        collection.objects.link(twin)
    return twin


def select(context: bpy.types.Context, items: Sequence[bpy.types.Object]) -> None:
    """Selects devices, and nothing else; the first becomes active."""
    context.view_layer.update()
    for item in context.selected_objects:
        item.select_set(False)
    for item in items:
        item.select_set(True)
    context.view_layer.objects.active = items[0] if items else None


def remove(items: Sequence[bpy.types.Object]) -> None:
    """Removes devices, and collections of devices that are empty then.

    Raises:
        AddonError: One stands in a collection of another file; nothing has changed then.
    """
    for item in items:
        for collection in item.users_collection:
            need_own(collection)
    for item in items:
        bpy.data.objects.remove(item)
    drop_empty(COLLECTION)


def mirror(item: bpy.types.Object, axis: int, plane_m: float, unit: float) -> None:
    """Moves a device to the other side of a plane across x (0) or y (1), looking back.

    An array with its centre in the device is its own mirror image; a TX array that stands beside
    the device (`tx_offset_m` along y) does not change sides, as all devices of a radio are alike.
    """
    flip = np.eye(4)
    flip[axis, axis] = -1.0
    flip[axis, 3] = 2.0 * plane_m
    # Turning local y as well keeps the axes right-handed.
    set_pose(item, flip @ pose_of(item, unit) @ np.diag([1.0, -1.0, 1.0, 1.0]), unit)
