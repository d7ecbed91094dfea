# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairs of meshes: thin double walls, split vertices, normals turned inwards."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from ..errors import AddonError
from ..scene.bodies import SPLIT_M
from ..scene.sheets import CLOSEST_M

#: Opposite faces look away from each other from this cosine between their normals.
_OPPOSITE = -0.95


def make_single_sheet(item: bpy.types.Object, unit: float) -> str:
    """Leaves one side of walls under 1 cm thick; their material holds the thickness.

    Args:
        item: Object with a mesh of its own.
        unit: Metres per Blender unit.

    Raises:
        AddonError: The mesh cannot be edited, or the second sheet is not in it.
    """
    thick = [modifier for modifier in item.modifiers if modifier.type == "SOLIDIFY"]
    if thick:
        for modifier in thick:
            item.modifiers.remove(modifier)
        return f"removed Solidify of {item.name}"
    with _edited(item) as work:
        gone = _second_side(work, CLOSEST_M / _metres(item, unit))
        if not gone:
            raise AddonError(f"object {item.name!r}: the second sheet comes from a modifier")
        count = len(gone)
        bmesh.ops.delete(work, geom=gone, context="FACES")
    return f"removed {count} faces of {item.name}"


def merge_split(item: bpy.types.Object, unit: float) -> str:
    """Merges vertices that an importer split, and turns normals outwards."""
    with _edited(item) as work:
        before = len(work.verts)
        distance = SPLIT_M / _metres(item, unit)
        bmesh.ops.remove_doubles(work, verts=work.verts, dist=distance)
        count = before - len(work.verts)
        _turn_outwards(work)
    return f"merged {count} vertices of {item.name}"


def turn_outwards(item: bpy.types.Object, _unit: float) -> str:
    """Turns normals of a body outwards."""
    with _edited(item) as work:
        _turn_outwards(work)
    return f"turned the normals of {item.name} outwards"


@contextmanager
def _edited(item: bpy.types.Object) -> Iterator[bmesh.types.BMesh]:
    """Yields an object's mesh and writes it back if the block succeeds.

    Raises:
        AddonError: It is no mesh, or not of the object's own.
    """
    mesh = item.data
    if not isinstance(mesh, bpy.types.Mesh):
        raise AddonError(f"object {item.name!r}: expected a mesh to repair")
    if mesh.users > 1:
        raise AddonError(
            f"object {item.name!r}: its mesh is shared by {mesh.users} objects; make it single user"
        )
    if item.mode != "OBJECT":
        raise AddonError(f"object {item.name!r}: leave edit mode first")
    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        yield work
        work.to_mesh(mesh)
        mesh.update()
    finally:
        work.free()


def _metres(item: bpy.types.Object, unit: float) -> float:
    """Metres per unit of an object's own axes."""
    return float(np.cbrt(abs(item.matrix_world.to_3x3().determinant()))) * unit


def _turn_outwards(work: bmesh.types.BMesh) -> None:
    bmesh.ops.recalc_face_normals(work, faces=work.faces)
    if work.calc_volume(signed=True) < 0:
        bmesh.ops.reverse_faces(work, faces=work.faces)


def _second_side(work: bmesh.types.BMesh, closest: float) -> list[bmesh.types.BMFace]:
    """Faces that are one side of double sheets, and the rims between the sides."""
    partner = _partners(work, closest)
    sides = _connected(set(partner))
    gone: set[bmesh.types.BMFace] = set()
    kept: set[bmesh.types.BMFace] = set()
    for side in sorted(sides, key=lambda faces: -sum(face.calc_area() for face in faces)):
        if side & gone:
            continue
        kept |= side
        behind = {partner[face] for face in side} - kept
        for other in sides:
            if other & behind:
                gone |= other
    front = gone
    while front:
        # Rims hang on what goes, ring by ring.
        front = {
            face
            for lost in front
            for edge in lost.edges
            for face in edge.link_faces
            if face not in partner and min(side.calc_length() for side in face.edges) <= closest
        } - gone
        gone |= front
    return list(gone)


def _partners(
    work: bmesh.types.BMesh, closest: float
) -> dict[bmesh.types.BMFace, bmesh.types.BMFace]:
    """Faces with an opposite face near behind them."""
    work.faces.ensure_lookup_table()
    work.normal_update()
    tree = BVHTree.FromBMesh(work)
    inward = -1.0 if work.calc_volume(signed=True) > 0 else 1.0
    found = {}
    for face in work.faces:
        middle = face.calc_center_median()
        way = inward * face.normal
        place, normal, index, _ = tree.ray_cast(middle + 1e-4 * closest * way, way, closest)
        if place is not None and normal.dot(face.normal) < _OPPOSITE:
            found[face] = work.faces[index]
            found.setdefault(work.faces[index], face)
    return found


def _connected(faces: set[bmesh.types.BMFace]) -> list[set[bmesh.types.BMFace]]:
    """Groups of faces that share edges."""
    left, groups = set(faces), []
    while left:
        group, front = set(), [left.pop()]
        while front:
            face = front.pop()
            group.add(face)
            near = {other for edge in face.edges for other in edge.link_faces} & left
            left -= near
            front += near
        groups.append(group)
    return groups
