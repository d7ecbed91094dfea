# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances: which surfaces belong together, what they are, where their joints are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from .errors import AddonError
from .frames import unit_scale
from .rig import Rig, read_rig
from .survey import Surface, evaluated_mesh, placements

#: Heights between which a moving instance is believable [m].
_SIZE_M = (0.3, 5.0)


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


def find_instances(surfaces: list[Surface]) -> tuple[list[Instance], list[dict[str, Any]]]:
    """Groups moving surfaces; also returns what was guessed about them.

    Raises:
        AddonError: An instance's size says that the unit scale is wrong.
    """
    rigs: dict[str, Rig | None] = {}
    for surface in surfaces:
        if surface.moving and surface.armature is not None:
            rigs.setdefault(surface.armature.name, read_rig(surface.armature))
    instances: dict[str, Instance] = {}
    for surface in surfaces:
        if surface.moving:
            name = _instance_name(surface, surfaces)
            new = Instance(len(instances) + 1, name, "other")
            instances.setdefault(name, new).surfaces.append(surface)
    guesses: list[dict[str, Any]] = []
    for instance in instances.values():
        _classify(instance, rigs, guesses)
        _check_size(instance)
        _size_up(instance, guesses)
    return list(instances.values()), guesses


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
    """Joints [P, 17, 3] in metres at the current frame, float32."""
    graph = bpy.context.evaluated_depsgraph_get()
    where = placements(scene)
    out = np.zeros((len(people), 17, 3))
    for index, person in enumerate(people):
        assert person.rig is not None and person.armature is not None
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


def _instance_name(surface: Surface, surfaces: list[Surface]) -> str:
    """The user's name, else the armature where it carries several meshes, else the object."""
    chosen = surface.root.rfgs.instance or surface.source.rfgs.instance
    if chosen:
        return chosen
    if surface.armature is not None:
        siblings = [other for other in surfaces if other.armature == surface.armature]
        if len(siblings) > 1:
            return surface.armature.name
    return surface.key


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
        instance.kind, why = "other", "moves, and is not skinned to a human armature"
    if why:
        note = {"what": "object_class", "object": instance.name, "value": instance.kind}
        guesses.append({**note, "why": why})
    if instance.kind != "person":
        instance.rig = None
    elif instance.rig is None:
        why = "no armature with known names of human bones"
        guesses.append({"what": "joints", "object": instance.name, "value": "none", "why": why})


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


def _check_size(instance: Instance) -> None:
    points = np.concatenate([surface.vertices for surface in instance.surfaces])
    size_m = float(np.ptp(points, axis=0).max())
    if not _SIZE_M[0] <= size_m <= _SIZE_M[1] and instance.kind == "person":
        raise AddonError(
            f"person {instance.name!r} is {size_m:.3g} m large, expected "
            f"{_SIZE_M[0]:g} to {_SIZE_M[1]:g} m; check the scene's unit scale"
        )
