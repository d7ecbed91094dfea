# SPDX-License-Identifier: GPL-3.0-or-later
"""What the buttons and the commands around devices do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np

from ..errors import AddonError
from ..ownership import need_own
from ..scene.bounds import HEADROOM_M
from ..scene.content import content_ready
from ..scene.frames import file_label, unit_scale
from ..scene.overrides import Overrides
from ..scene.surroundings import Surroundings
from ..tables import RADIO_FIELDS, RADIO_PLACEMENTS
from . import empties
from .placement import Mesh, spots


def scene_space(
    scene: bpy.types.Scene,
) -> tuple[np.ndarray, list[Mesh], Surroundings | None]:
    """Bounds [2, 3] of what radio sees [m], what stands there, and the room around the people.

    Raises:
        AddonError: Nothing has a surface, or the scene has no frame range.
    """
    with content_ready(scene, None, Overrides()) as content:
        if not content.surfaces:
            raise AddonError(f"{file_label()}: no mesh that renders, so the scene has no bounds")
        meshes = [(row.vertices, row.faces) for row in content.surfaces if not row.moving]
        if content.space is not None:
            return content.bounds.copy(), meshes, content.surroundings()
        low = np.min([surface.low for surface in content.surfaces], axis=0)
        high = np.max([surface.high for surface in content.surfaces], axis=0)
        return _upright(np.stack([low, high])), meshes, None


def around(
    scene: bpy.types.Scene, items: Iterable[bpy.types.Object], margin_m: float
) -> np.ndarray:
    """A box [2, 3] around objects as they stand now [m], `margin_m` wider on each side.

    Raises:
        AddonError: None of them has a surface.
    """
    graph = bpy.context.evaluated_depsgraph_get()
    corners = [
        np.array(shown.matrix_world) @ (*corner, 1.0)
        for shown in (item.evaluated_get(graph) for item in items if item.type != "EMPTY")
        for corner in shown.bound_box
    ]
    if not corners:
        raise AddonError("no object with a surface is selected; select what radio shall surround")
    points = np.array(corners)[:, :3] * unit_scale(scene)
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    box[:, :2] += [[-margin_m], [margin_m]]
    return _upright(box)


def place_radio(
    scene: bpy.types.Scene,
    radio: str,
    space: tuple[np.ndarray, list[Mesh], Surroundings | None],
    *,
    keep: bool,
) -> list[bpy.types.Object]:
    """Adds all devices of a preset by its own rule.

    Args:
        scene: The scene.
        radio: Name of the preset.
        space: What they stand within and must not stand in, as `scene_space` has it.
        keep: Whether devices of this radio that are there already stay.

    Raises:
        AddonError: They do not fit.
    """
    places = spots(radio, *space)
    if not keep:
        empties.remove([item for item in empties.devices(scene) if item.rfgs.radio == radio])
    # Names sort in the order of the places, which a device that moves goes through.
    digits = len(str(len(places) - 1))
    return [
        empties.add_device(
            scene,
            name=f"{radio}_{index:0{digits}d}",
            role="ACCESS_POINT",
            radio=radio,
            pose=spot.pose(),
            fields=RADIO_FIELDS[radio],
        )
        for index, spot in enumerate(places)
    ]


def others_of(scene: bpy.types.Scene, radio: str) -> str:
    """The end of a message about a placed preset: which other devices take part in it."""
    others = [item.name for item in empties.devices(scene) if item.rfgs.radio.strip() == "any"]
    if not others or RADIO_PLACEMENTS[radio]["placement"] != "corners":
        return ""
    return f"; {', '.join(others)} for any radio take part too"


def mirror_devices(
    scene: bpy.types.Scene, items: Iterable[bpy.types.Object], axis: int, *, copy: bool
) -> list[bpy.types.Object]:
    """Mirrors devices, or copies of them, at the middle of the scene across x (0) or y (1)."""
    bounds, _, _ = scene_space(scene)
    twins = [empties.duplicate(scene, item) if copy else item for item in items]
    for twin in twins:
        # A fresh copy has no world matrix before the scene is evaluated.
        bpy.context.view_layer.update()
        empties.mirror(twin, axis, float(bounds[:, axis].mean()), unit_scale(scene))
    return twins


def match_devices(scene: bpy.types.Scene, source: bpy.types.Object) -> int:
    """Gives every Empty of the scene's own radio the properties of one; returns how many.

    Raises:
        AddonError: One is linked from another file; none has changed then.
    """
    fields = source.rfgs.rf.row()
    others = [
        item
        for item in empties.devices(scene)
        if item.rfgs.radio.strip() in empties.OWN_RADIOS and item.rfgs.rf.row() != fields
    ]
    for item in others:
        need_own(item)
    for item in others:
        item.rfgs.rf.take(fields)
    return len(others)


def describe(item: bpy.types.Object, unit: float) -> dict[str, Any]:
    """One device as data: name, role, radio, place [m], boresight, elements, band and power."""
    fields, pose = empties.radio_fields(item), empties.pose_of(item, unit)
    return {
        "name": item.name,
        "role": item.rfgs.role,
        "radio": item.rfgs.radio.strip() or "any",
        "position_m": np.round(pose[:3, 3], 6).tolist(),
        "boresight": np.round(pose[:3, 0], 6).tolist(),
        **fields,
    }


def _upright(box: np.ndarray) -> np.ndarray:
    box[1, 2] = max(box[1, 2], box[0, 2] + HEADROOM_M)
    return box
