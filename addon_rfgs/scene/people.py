# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances: which surfaces belong together, what they are, where their joints are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import bpy
import mathutils
import numpy as np

from .findings import Finding
from .frames import unit_scale
from .grouping import SEPARATE_SHARE, instance_names, stand
from .rig import Rig, read_rig
from .survey import Surface, evaluated_mesh, placements

#: Heights between which a moving instance is believable [m].
_SIZE_M = (0.3, 5.0)
#: A person who is never this long in any direction is drawn in another unit [m].
_SMALLEST_PERSON_M = 0.5
#: Between these a person needs no second look, arms overhead included [m].
_USUAL_PERSON_M = (0.8, 2.6)


@dataclass
class Instance:
    """One thing in the masks: a person, a vehicle or something else that moves."""

    id: int
    name: str
    kind: str
    """person, vehicle or other"""
    surfaces: list[Surface] = field(default_factory=list)
    armature: bpy.types.Object | None = None
    rig: Rig | None = None
    surface_m2: float = 0.0
    """Nominal outer surface [m²]; 0 leaves it to the reader."""

    def row(self) -> dict[str, Any]:
        """Row of `bundle.json`."""
        return {
            "id": self.id,
            "name": self.name,
            "class": self.kind,
            "person": self.kind == "person",
            "nominal_surface_m2": self.surface_m2 or None,
        }


def find_instances(
    surfaces: list[Surface],
) -> tuple[list[Instance], list[dict[str, Any]], list[Finding]]:
    """Groups moving surfaces; also returns what was guessed about them, and what is wrong.

    The scene stands at its first frame.
    """
    rigs: dict[str, Rig | None] = {}
    for surface in surfaces:
        if surface.moving and surface.armature is not None:
            rigs.setdefault(surface.armature.name, read_rig(surface.armature))
    instances: dict[str, Instance] = {}
    for surface, name in instance_names([item for item in surfaces if item.moving]):
        new = Instance(len(instances) + 1, name, "other")
        instances.setdefault(name, new).surfaces.append(surface)
    guesses: list[dict[str, Any]] = []
    findings = _shared_sources(surfaces, instances.values())
    for instance in instances.values():
        _classify(instance, rigs, guesses)
        findings += _size_findings(instance)
        _size_up(instance, guesses)
    if instances and all(_size_m(item) < _SIZE_M[0] for item in instances.values()):
        findings.append(
            Finding(
                "error",
                "the scene",
                f"everything that moves is smaller than {_SIZE_M[0]:g} m",
                "check the unit scale",
                "unit_scale",
            )
        )
    return list(instances.values()), guesses, findings


def segments(surface: Surface, rig: Rig | None) -> np.ndarray:
    """Joint that each face of `surface` follows, [T] int32, -1 where there is no rig.

    The joint of a vertex is that of the bone with most weight; a face takes the joint most of
    its corners agree on, the first corner's where none do.
    """
    out = np.full(len(surface.faces), -1, np.int32)
    if rig is None:
        return out
    source = surface.source
    if source.parent_type == "BONE" and source.parent_bone in rig.segments:
        out[:] = rig.segments[source.parent_bone]
        return out
    joint_of_group = [rig.segments.get(group.name, -1) for group in source.vertex_groups]
    vertices = np.full(len(surface.local), -1, np.int32)
    evaluated = source.evaluated_get(bpy.context.evaluated_depsgraph_get())
    with evaluated_mesh(evaluated) as mesh:
        for index, vertex in enumerate(mesh.vertices):
            weight = 0.0
            for part in vertex.groups:
                if part.group < len(joint_of_group) and part.weight > weight:
                    if joint_of_group[part.group] >= 0:
                        weight, vertices[index] = part.weight, joint_of_group[part.group]
    first, second, third = vertices[surface.faces].T
    return np.where(second == third, second, first).astype(np.int32)


def joints(scene: bpy.types.Scene, people: list[Instance]) -> np.ndarray:
    """Joints [P, 17, 3] in metres at the current frame, float32; NaN where unknown."""
    graph = bpy.context.evaluated_depsgraph_get()
    where = placements(scene)
    out = np.full((len(people), 17, 3), np.nan)
    for index, person in enumerate(people):
        if person.rig is None or person.armature is None:
            continue
        points = person.rig.joints(person.armature.evaluated_get(graph))
        # An instanced person stands where the instance is, not where its armature is.
        surface = person.surfaces[0]
        own = np.array(surface.source.evaluated_get(graph).matrix_world, dtype=np.float64)
        shift = where[surface.key] @ np.linalg.inv(own)
        out[index] = (points @ shift[:3, :3].T + shift[:3, 3]) * unit_scale(scene)
    return out.astype(np.float32)


def action_label(person: Instance, frame: int) -> str:
    """What the person does at `frame`: the last pose marker there, else the action's name."""
    data = person.armature.animation_data if person.armature else None
    if data is None:
        return ""
    if data.action is not None:
        passed = [marker for marker in data.action.pose_markers if marker.frame <= frame]
        return max(passed, key=lambda m: m.frame).name if passed else data.action.name
    for track in reversed(data.nla_tracks):
        for strip in track.strips:
            if not track.mute and strip.frame_start <= frame <= strip.frame_end and strip.action:
                return strip.action.name
    return ""


def _classify(
    instance: Instance, rigs: dict[str, Rig | None], guesses: list[dict[str, Any]]
) -> None:
    classes = {surface.object_class for surface in instance.surfaces}
    armatures = [surface.armature for surface in instance.surfaces if surface.armature is not None]
    instance.armature = next((item for item in armatures if rigs[item.name]), None)
    if instance.armature is not None:
        instance.rig = rigs[instance.armature.name]
    if "PERSON" in classes:
        instance.kind, why = "person", ""
    elif "VEHICLE" in classes:
        instance.kind, why = "vehicle", ""
    elif instance.rig is not None:
        instance.kind, why = "person", f"armature {instance.armature.name!r} has human joints"
    else:
        instance.kind, why = "other", _no_person(armatures)
    if why:
        note = {"what": "object_class", "object": instance.name, "value": instance.kind}
        guesses.append({**note, "why": why})
    if instance.kind != "person":
        instance.rig = None
        return
    why = "" if instance.rig else "no armature with the bones of a human"
    if instance.rig and not _stands_at(instance, instance.armature):
        instance.rig, why = None, f"armature {instance.armature.name!r} stands somewhere else"
    if why:
        guesses.append({"what": "joints", "object": instance.name, "value": "unknown", "why": why})


def _no_person(armatures: list[bpy.types.Object]) -> str:
    """Why something that moves is not taken for a person."""
    if not armatures:
        return "moves, and no armature moves it"
    names = ", ".join(repr(name) for name in sorted({item.name for item in armatures}))
    why = f"skinned to armature {names}, whose bones are not a human's"
    return f"{why}; if it is a person, say so (class Person, or --people NAME)"


def _size_up(instance: Instance, guesses: list[dict[str, Any]]) -> None:
    """Takes the user's nominal surface; a vehicle without one gets that of its box."""
    owners = [item.rfgs for surface in instance.surfaces for item in (surface.root, surface.source)]
    instance.surface_m2 = round(max(owner.surface_m2 for owner in owners), 3)
    if instance.surface_m2 == 0.0 and instance.kind == "vehicle":
        points = np.concatenate([surface.vertices for surface in instance.surfaces])
        x, y, z = np.ptp(points, axis=0)
        instance.surface_m2 = round(2.0 * float(x * y + y * z + z * x), 3)
        note = {"what": "nominal_surface_m2", "object": instance.name}
        why = "a vehicle without a nominal surface: that of the box around it in the first frame"
        guesses.append({**note, "value": f"{instance.surface_m2:g}", "why": why})


def _stands_at(instance: Instance, armature: bpy.types.Object) -> bool:
    """Whether the armature's middle is where an instance stands, so that its joints are meant.

    Two characters may share one armature, and only one of them stands where its bones are.
    """
    if any(surface.root != surface.source for surface in instance.surfaces):
        return True  # Joints follow the instance.
    posed = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    middle = posed.matrix_world @ mathutils.Vector(
        np.mean([bone.head for bone in posed.pose.bones], axis=0)
    )
    vertices = np.concatenate([surface.vertices for surface in instance.surfaces])
    offset = stand(vertices) - np.array(middle[:2]) * unit_scale(bpy.context.scene)
    return float(np.hypot(*offset)) < SEPARATE_SHARE * _size_m(instance)


def _first_box(instance: Instance) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner [3] of an instance in the first frame [m]."""
    points = np.concatenate([surface.vertices for surface in instance.surfaces])
    return points.min(axis=0), points.max(axis=0)


def _size_m(instance: Instance) -> float:
    low, high = _first_box(instance)
    return float((high - low).max())


def _size_findings(instance: Instance) -> list[Finding]:
    low, high = _first_box(instance)
    size_m, height_m, largest = float((high - low).max()), float(high[2] - low[2]), _SIZE_M[1]
    if size_m < _USUAL_PERSON_M[0]:
        # Who is curled up at first may stand up later.
        later = np.concatenate([np.ptp(surface.boxes, axis=1) for surface in instance.surfaces])
        size_m = max(size_m, float(later.max()))
    name, remedy = instance.name, "check the unit scale"
    if instance.kind == "person" and not _SMALLEST_PERSON_M <= size_m <= largest:
        message = f"is a person of {size_m:.3g} m, expected {_SMALLEST_PERSON_M:g} to {largest:g} m"
        return [Finding("error", name, message, remedy, "unit_scale")]
    usual = " to ".join(f"{value:g}" for value in _USUAL_PERSON_M)
    if instance.kind == "person" and not _USUAL_PERSON_M[0] <= size_m <= _USUAL_PERSON_M[1]:
        message = f"is a person of {size_m:.3g} m; {usual} m are usual"
        # No kind of the repairs: a child is no mistake of the unit.
        return [Finding("warning", name, message, f"{remedy} if that is not meant")]
    if height_m > largest:
        message = f"moves and is {height_m:.3g} m tall, expected at most {largest:g} m"
        remedy = f"{remedy} or drop it (class Ignore)"
        return [Finding("error", name, message, remedy, "unit_scale")]
    return []


def _shared_sources(surfaces: list[Surface], instances: Iterable[Instance]) -> list[Finding]:
    """One object cannot carry two instance ids in a rendered mask."""
    owner = {surface.key: item.id for item in instances for surface in item.surfaces}
    users: dict[str, list[Surface]] = {}
    for surface in surfaces:
        users.setdefault(surface.source.name, []).append(surface)
    findings = []
    for name, shared in users.items():
        if len({owner.get(surface.key, 0) for surface in shared}) > 1:
            keys = ", ".join(surface.key for surface in shared[:3])
            findings.append(
                Finding(
                    "error",
                    name,
                    f"moves and is instanced {len(shared)} times ({keys})",
                    "make the instances real (Object > Apply > Make Instances Real) or drop some",
                )
            )
    return findings
