# SPDX-License-Identifier: GPL-3.0-or-later
"""Which findings have a repair, and how each is done."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..errors import AddonError
from ..ownership import need_own
from ..scene.check import check_scene
from ..scene.findings import Finding
from ..scene.frames import file_label, unit_scale
from ..scene.overrides import Overrides
from . import mesh_repairs, scene_repairs

_MESHES: dict[str, Callable[[bpy.types.Object, float], str]] = {
    "double_sheet": mesh_repairs.make_single_sheet,
    "split_body": mesh_repairs.merge_split,
    "inside_out": mesh_repairs.turn_outwards,
}
_DEVICES = ("device_inside", "device_outside")
#: Kinds of findings with a repair.
REPAIRABLE = ("unit_scale", "material_band", "devices_differ", *_DEVICES, *_MESHES)
#: Those that change how everything is understood, so that a user is asked first.
ASK_FIRST = ("unit_scale",)


def findings(
    scene: bpy.types.Scene, frames: str = "", overrides: Overrides | None = None
) -> list[Finding]:
    """Everything the scene check finds, the worst first.

    What keeps the check from looking at all is an error in the list.
    """
    try:
        return [Finding(**row) for row in check_scene(scene, frames or None, overrides)["findings"]]
    except AddonError as error:
        said = str(error).removeprefix(f"{file_label()}: ")
        message, _, remedy = said.partition("; ")
        return [Finding("error", "the scene", message, remedy)]


def repairable(scene: bpy.types.Scene, finding: Finding) -> bool:
    """Whether `repair` would do something about a finding."""
    try:
        for block in _changed(scene, finding):
            need_own(block)
        if finding.kind == "material_band":
            scene_repairs.guess_in_band(scene, finding.material)
    except AddonError:
        return False
    return finding.kind in REPAIRABLE


def repair(scene: bpy.types.Scene, finding: Finding) -> str:
    """Does what is safe about a finding.

    Returns:
        What was done.

    Raises:
        AddonError: Nothing can be done, or not in this file.
    """
    for block in _changed(scene, finding):
        need_own(block)
    if finding.kind in _MESHES:
        return _MESHES[finding.kind](meant(scene, finding), unit_scale(scene))
    if finding.kind in _DEVICES:
        return scene_repairs.move_device(scene, finding.object)
    if finding.kind == "unit_scale":
        return scene_repairs.set_unit(scene)
    if finding.kind == "material_band":
        return scene_repairs.set_to_guess(scene, finding.material)
    if finding.kind == "devices_differ":
        return scene_repairs.make_alike(scene)
    raise AddonError(f"{finding.sentence}: no safe repair")


def _changed(scene: bpy.types.Scene, finding: Finding) -> list[bpy.types.ID]:
    """What a repair changes, beside the scene."""
    if finding.kind in _MESHES:
        item = meant(scene, finding)
        return [item, item.data]
    if finding.kind in _DEVICES:
        return [meant(scene, finding)]
    if finding.kind == "material_band" and finding.material in bpy.data.materials:
        return [bpy.data.materials[finding.material]]
    return []


def meant(scene: bpy.types.Scene, finding: Finding) -> bpy.types.Object:
    """The object that a finding is about: of an instance, the object with the geometry.

    Raises:
        AddonError: It is about the whole scene, or the object is gone.
    """
    key = finding.object.partition("#")[0]
    for name in (finding.object, key, key.rpartition("/")[2], key.partition("/")[0]):
        if name in scene.objects:
            return scene.objects[name]
    raise AddonError(f"{file_label()}: no object {finding.object!r} in the scene")


def select_meant(context: bpy.types.Context, finding: Finding) -> bpy.types.Object:
    """Selects the object that a finding is about, and nothing else.

    Raises:
        AddonError: There is none, or it is not in the view layer.
    """
    item = meant(context.scene, finding)
    if item.name not in context.view_layer.objects:
        raise AddonError(f"object {item.name!r} is excluded from the view layer")
    for other in context.view_layer.objects:
        other.select_set(other == item)
    item.hide_set(False)
    item.select_set(True)
    context.view_layer.objects.active = item
    return item
