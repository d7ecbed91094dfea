# SPDX-License-Identifier: GPL-3.0-or-later
"""A body as an ordinary rigged Blender character: one skinned mesh and its armature."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from blender_scenes.body import Body
from blender_scenes.clothes import Cut, cuts, limb_weights, surface_of
from blender_scenes.surfaces import material

#: Share of the body's triangles that is kept.
DETAIL = 0.30
#: Material slots of a person, in order.
SLOTS = ("skin", "hair", "shirt", "trousers", "shoes", "soles")

# Bones point at the child that continues the limb; all others end where their parent would.
_NEXT = {
    "foot.L": "toe1-1.L",
    "foot.R": "toe1-1.R",
    "spine01": "neck01",
    "wrist.L": "finger3-1.L",
    "wrist.R": "finger3-1.R",
}


def build_character(name: str, body: Body, collection: bpy.types.Collection) -> bpy.types.Object:
    """Builds the armature `name` and its skinned mesh; returns the armature object."""
    armature = _armature(name, body, collection)
    mesh = bpy.data.meshes.new(f"{name}_body")
    mesh.from_pydata(body.vertices.tolist(), [], body.faces.tolist())
    for slot in SLOTS:
        mesh.materials.append(material(slot))
    skinned = bpy.data.objects.new(f"{name}_body", mesh)
    skinned.rfgs.object_class, skinned.rfgs.instance = "PERSON", name
    collection.objects.link(skinned)
    _add_weights(skinned, body.bones, body.weights)
    _reduce(skinned)
    _paint(skinned, body)
    skinned.data.shade_smooth()
    skinned.parent = armature
    modifier = skinned.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    return armature


def _armature(name: str, body: Body, collection: bpy.types.Collection) -> bpy.types.Object:
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(f"{name}_rig"))
    collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    edit = armature.data.edit_bones
    for index, bone in enumerate(body.bones):
        made = edit.new(bone)
        made.head, made.tail = body.heads[index], _tail(body, index)
        if body.parents[index] >= 0:
            made.parent = edit[body.bones[body.parents[index]]]
        # Left and right roll alike, so that Blender's mirrored posing works.
        made.align_roll((0.0, -1.0, 0.0))
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data.display_type = "STICK"
    armature.show_in_front = True
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
    return armature


def _tail(body: Body, index: int) -> np.ndarray:
    head, name = body.heads[index], body.bones[index]
    children = [i for i, parent in enumerate(body.parents) if parent == index]
    if name in _NEXT:
        return body.head(_NEXT[name])
    if len(children) == 1 and np.linalg.norm(body.heads[children[0]] - head) > 1e-3:
        return body.heads[children[0]]
    if name in ("root", "head"):
        return head + np.array([0.0, 0.0, 0.15])
    if name.startswith("toe"):
        return head + np.array([0.0, -0.06, 0.0])
    direction = head - body.heads[body.parents[index]]
    length = max(float(np.linalg.norm(direction)), 1e-3)
    return head + direction / length * min(max(length, 0.02), 0.08)


def _add_weights(skinned: bpy.types.Object, bones: tuple[str, ...], weights: np.ndarray) -> None:
    for column, bone in enumerate(bones):
        rows = np.flatnonzero(weights[:, column] > 1e-3)
        group = skinned.vertex_groups.new(name=bone)
        for row in rows.tolist():
            group.add([row], float(weights[row, column]), "REPLACE")


def _weights(skinned: bpy.types.Object) -> np.ndarray:
    """Skin weights of the mesh as it is now, rows sum to 1, shape (V, B)."""
    weights = np.zeros((len(skinned.data.vertices), len(skinned.vertex_groups)))
    for vertex in skinned.data.vertices:
        for entry in vertex.groups:
            weights[vertex.index, entry.group] = entry.weight
    return weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)


def _reduce(skinned: bpy.types.Object) -> None:
    """Collapses edges where the surface is flat; Blender carries the weights along."""
    modifier = skinned.modifiers.new("Reduce", "DECIMATE")
    modifier.ratio = DETAIL
    modifier.use_symmetry = False
    bpy.context.view_layer.update()
    reduced = bpy.data.meshes.new_from_object(
        skinned.evaluated_get(bpy.context.evaluated_depsgraph_get())
    )
    old = skinned.data
    skinned.modifiers.remove(modifier)
    name = old.name
    skinned.data = reduced
    bpy.data.meshes.remove(old)
    reduced.name = name


def _paint(skinned: bpy.types.Object, body: Body) -> None:
    """Cuts the mesh along the borders of clothes and gives each face its material."""
    borders = cuts(body)
    for cut in borders.values():
        _bisect(skinned, body, cut)
    mesh = skinned.data
    limbs = _face_limbs(skinned, body)
    centres = np.array([polygon.center[:] for polygon in mesh.polygons])
    for polygon, name in zip(mesh.polygons, surface_of(centres, limbs, borders), strict=True):
        polygon.material_index = SLOTS.index(name)


def _face_limbs(skinned: bpy.types.Object, body: Body) -> np.ndarray:
    """Index in `clothes.LIMBS` of the limb each face lies on, shape (T,)."""
    present = Body(
        np.zeros((0, 3)), body.faces, body.bones, body.parents, body.heads, _weights(skinned)
    )
    shares = limb_weights(present)
    return np.array(
        [shares[list(polygon.vertices)].sum(axis=0).argmax() for polygon in skinned.data.polygons]
    )


def _bisect(skinned: bpy.types.Object, body: Body, cut: Cut) -> None:
    mesh = skinned.data
    limbs = _face_limbs(skinned, body)
    centres = np.array([polygon.center[:] for polygon in mesh.polygons])
    everywhere = Cut(cut.limbs, cut.side, cut.point - 10 * cut.normal, cut.normal)
    chosen = np.flatnonzero(everywhere.beyond(centres, limbs))
    bm = bmesh.new()
    bm.from_mesh(mesh)
    bm.faces.ensure_lookup_table()
    faces = [bm.faces[index] for index in chosen]
    edges = list({edge for face in faces for edge in face.edges})
    verts = list({vert for face in faces for vert in face.verts})
    bmesh.ops.bisect_plane(
        bm,
        geom=sorted(verts, key=lambda v: v.index)
        + sorted(edges, key=lambda e: e.index)
        + sorted(faces, key=lambda f: f.index),
        plane_co=cut.point,
        plane_no=cut.normal,
        dist=2e-3,
    )
    # Triangles only: a bent quad may be split differently from one frame to the next.
    bmesh.ops.triangulate(bm, faces=bm.faces[:])
    bm.to_mesh(mesh)
    bm.free()
