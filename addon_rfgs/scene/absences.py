# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file holds that radio does not see, each with the reason."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import bpy

from ..ownership import is_shown_by_us
from .findings import Finding
from .state import Keeper
from .survey import Surface

#: Kinds of objects without surfaces, in words.
_NO_SURFACE = {
    "CURVES": "hair curves",
    "GREASEPENCIL": "grease pencil",
    "GPENCIL": "grease pencil",
    "POINTCLOUD": "a point cloud",
    "VOLUME": "a volume",
}
#: Objects of these types have no part in the scene by their nature.
_HELPERS = {"ARMATURE", "CAMERA", "EMPTY", "LATTICE", "LIGHT", "LIGHT_PROBE", "SPEAKER"}


def absences(
    scene: bpy.types.Scene, surfaces: Iterable[Surface], known: Iterable[Finding]
) -> list[Finding]:
    """Lists objects that are left out and files that are missing.

    Args:
        scene: Scene of the open file.
        surfaces: What is not left out.
        known: Findings that already say why an object is left out.
    """
    present = {name for item in surfaces for name in (item.source.name, item.root.name)}
    present |= {part for row in known for part in row.object.partition("#")[0].split("/")}
    present |= _bone_shapes().keys()
    findings = []
    for item in sorted(bpy.data.objects, key=lambda item: item.name):
        ignored = item.rfgs.object_class == "IGNORE"
        # Nobody misses what the add-on itself has drawn.
        if item.name not in present and not (ignored and is_shown_by_us(item)):
            findings += _left_out(scene, item)
        findings += _strands(item)
    others = [other.name for other in bpy.data.scenes if other != scene]
    if others:
        message = f"only the scene {scene.name!r} is used, not {', '.join(others)}"
        findings.append(Finding("info", "the scene", message, "save the file with the other open"))
    return [*findings, *_missing_libraries(scene), *_missing_pictures()]


def hide_bone_shapes(keeper: Keeper) -> list[Finding]:
    """Hides meshes that only draw the bones of armatures, from radio and pictures."""
    shapes = _bone_shapes()
    shown = [name for name, item in sorted(shapes.items()) if not item.hide_render]
    for name in shown:
        keeper.set(shapes[name], "hide_render", True)
    if not shown:
        return []
    names = ", ".join(shown[:4]) + (", …" if len(shown) > 4 else "")
    return [Finding("info", "the scene", f"shapes of bones are left out: {names}")]


def _bone_shapes() -> dict[str, bpy.types.Object]:
    """Shapes of bones, and what lies with them in a collection that mostly holds such."""
    used = {
        bone.custom_shape.name: bone.custom_shape
        for item in bpy.data.objects
        if item.type == "ARMATURE" and item.pose
        for bone in item.pose.bones
        if bone.custom_shape is not None
    }
    found = dict(used)
    for collection in bpy.data.collections:
        names = {item.name for item in collection.objects if item.type not in _HELPERS}
        if 2 * len(names & used.keys()) > len(names):
            found.update({name: bpy.data.objects[name] for name in names})
    return found


def _left_out(scene: bpy.types.Scene, item: bpy.types.Object) -> Iterator[Finding]:
    if item.type in _HELPERS:
        return
    kind = item.type.lower()
    if item.name not in scene.objects:
        if item.users_scene or not item.users_collection:
            return  # Of another scene, or data without a place.
        if _instanced(item):
            return
        yield Finding("info", item.name, f"is a {kind} outside the scene, left out")
    elif item.rfgs.object_class == "IGNORE":
        yield Finding("info", item.name, f"is a {kind} of the class Ignore, left out")
    elif item.hide_render:
        yield Finding("info", item.name, f"is a {kind} disabled for renders, left out")
    elif item.name not in bpy.context.view_layer.objects or _hidden_by_collection(item):
        message = f"is a {kind} in a collection excluded from renders, left out"
        yield Finding("info", item.name, message)
    elif item.type in _NO_SURFACE:
        message = f"is {_NO_SURFACE[item.type]}: radio sees surfaces only, left out"
        remedy = "convert it to a mesh if it matters" if item.type != "VOLUME" else ""
        yield Finding("warning", item.name, message, remedy)
    elif not item.show_instancer_for_render and item.is_instancer:
        return  # Its copies are there.
    else:
        yield Finding("info", item.name, f"is a {kind} without faces, left out")


def _instanced(item: bpy.types.Object) -> bool:
    """Whether some Empty brings a collection of the object into the scene."""
    homes = set(item.users_collection)
    return any(
        other.instance_type == "COLLECTION" and other.instance_collection in homes
        for other in bpy.context.view_layer.objects
    )


def _hidden_by_collection(item: bpy.types.Object) -> bool:
    return bool(item.users_collection) and all(
        collection.hide_render for collection in item.users_collection
    )


def _strands(item: bpy.types.Object) -> Iterator[Finding]:
    """Hair of a particle system that renders as strands."""
    for system in item.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            yield Finding(
                "warning", item.name, f"has hair {system.name!r}, which radio does not see"
            )
    for modifier in item.modifiers:
        if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN" and modifier.show_render:
            if modifier.domain_settings.domain_type == "GAS":
                yield Finding("warning", item.name, "is smoke, which radio does not see")


def _missing_libraries(scene: bpy.types.Scene) -> Iterator[Finding]:
    """Linked files that are not there; objects that need them make it an error."""
    for library in bpy.data.libraries:
        path = Path(bpy.path.abspath(library.filepath, library=library.parent))
        if path.is_file():
            continue
        users = [
            item.name
            for item in scene.objects
            if library in _libraries(item) and item.rfgs.object_class != "IGNORE"
        ]
        shown = ", ".join(repr(name) for name in users[:3]) + (", …" if len(users) > 3 else "")
        message = f"linked library {library.filepath} is missing" + (
            f"; {shown} came from it" if users else ""
        )
        remedy = "put the file in its place, or drop what came from it"
        yield Finding("error" if users else "warning", "the scene", message, remedy)


def _libraries(item: bpy.types.Object) -> set[bpy.types.Library]:
    blocks = (item, item.data, item.instance_collection)
    return {block.library for block in blocks if block is not None and block.library}


def _missing_pictures() -> Iterator[Finding]:
    for image in bpy.data.images:
        if image.source != "FILE" or image.packed_file or not image.users or not image.filepath:
            continue
        if not Path(bpy.path.abspath(image.filepath, library=image.library)).is_file():
            message = f"picture {image.filepath} is missing, so surfaces with it render pink"
            yield Finding("warning", "the scene", message, "find it (File > External Data)")
