# SPDX-License-Identifier: GPL-3.0-or-later
"""A body as an ordinary rigged Blender character: one skinned mesh and its armature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bmesh
import bpy
import numpy as np

from blender_scenes.people.body import Body
from blender_scenes.people.clothes import Cut, Look, cuts, limb_weights, surface_of
from blender_scenes.surfaces import SURFACES, material, new_material

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


def build_character(
    name: str, body: Body, collection: bpy.types.Collection, look: Look | None = None
) -> bpy.types.Object:
    """Builds the armature `name` and its skinned mesh.

    Args:
        name: Name of the armature and of the instance in masks.
        body: The dressed body.
        collection: Where the objects go.
        look: Clothes and colours, in materials of this person's own; without it the ordinary
            ones, shared by all who wear them.

    Returns:
        The armature object; the mesh `<name>_body` is its child.
    """
    armature = add_armature(name, body, collection)
    worn = [material(slot) if look is None else _own_material(name, slot, look) for slot in SLOTS]
    skinned = add_skin(name, body, worn, collection)
    _reduce(skinned)
    _paint(skinned, body, look or Look())
    follow(armature, skinned)
    return armature


def add_skin(
    name: str,
    body: Body,
    materials: Sequence[bpy.types.Material],
    collection: bpy.types.Collection,
    least_weight: float = 1e-3,
) -> bpy.types.Object:
    """Adds the mesh `<name>_body` of a person, with weights; all of it has the first material.

    Weights up to `least_weight` are left out.
    """
    mesh = bpy.data.meshes.new(f"{name}_body")
    mesh.from_pydata(body.vertices.tolist(), [], body.faces.tolist())
    for each in materials:
        mesh.materials.append(each)
    skinned = bpy.data.objects.new(f"{name}_body", mesh)
    skinned.rfgs.object_class, skinned.rfgs.instance = "PERSON", name
    collection.objects.link(skinned)
    _add_weights(skinned, body.bones, body.weights, least_weight)
    return skinned


def follow(armature: bpy.types.Object, skinned: bpy.types.Object) -> None:
    """Makes a smooth skin the child of an armature, whose bones move it."""
    skinned.data.shade_smooth()
    skinned.parent = armature
    modifier = skinned.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature


def add_breath(skinned: bpy.types.Object, body: Body, depth_m: float) -> None:
    """Adds the shape key `breath`: at 1 the breast bone has moved out by `depth_m` [m].

    The belly follows with two thirds of that, flanks with a third, the back hardly.
    """
    mesh = skinned.data
    points = np.array([vertex.co[:] for vertex in mesh.vertices])
    normals = np.array([vertex.normal[:] for vertex in mesh.vertices])
    trunk = _weights(skinned)[:, [n for n, b in enumerate(body.bones) if b.startswith("spine")]]
    chest, belly = (points[:, 2] - body.head(name)[2] for name in ("spine01", "spine04"))
    amount = np.exp(-((chest / 0.12) ** 2)) + 0.66 * np.exp(-((belly / 0.09) ** 2))
    front = np.clip(0.35 - 0.65 * normals[:, 1], 0.0, 1.0)
    moved = points + (depth_m * amount * front * trunk.sum(axis=1))[:, None] * normals
    skinned.shape_key_add(name="basis", from_mix=False)
    block = skinned.shape_key_add(name="breath", from_mix=False)
    block.data.foreach_set("co", moved.astype(np.float32).ravel())


def add_armature(name: str, body: Body, collection: bpy.types.Collection) -> bpy.types.Object:
    """Adds the armature of a body at rest; its bones turn by quaternions."""
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
    if name == "head" or body.parents[index] < 0:
        return head + np.array([0.0, 0.0, 0.15])
    if name.startswith("toe"):
        return head + np.array([0.0, -0.06, 0.0])
    direction = head - body.heads[body.parents[index]]
    length = max(float(np.linalg.norm(direction)), 1e-3)
    return head + direction / length * min(max(length, 0.02), 0.08)


def _add_weights(
    skinned: bpy.types.Object, bones: tuple[str, ...], weights: np.ndarray, least: float
) -> None:
    for column, bone in enumerate(bones):
        rows = np.flatnonzero(weights[:, column] > least)
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


def _own_material(name: str, slot: str, look: Look) -> bpy.types.Material:
    """The material of one person's slot, in the colour of her or his look."""
    surface, colour = SURFACES[slot], getattr(look, slot, None)
    if colour is not None:
        # Cloth keeps its blotches: the second colour is a little darker.
        second = (0.85 * colour[0], 0.85 * colour[1], 0.85 * colour[2])
        surface = replace(surface, colour=colour, second=second)
    return new_material(f"{name}_{slot}", surface)


def _paint(skinned: bpy.types.Object, body: Body, look: Look) -> None:
    """Cuts the mesh along the borders of clothes and gives each face its material."""
    borders = cuts(body, look)
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
