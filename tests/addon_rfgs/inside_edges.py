# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges that meshes speak of, inside Blender; `test_inside_blender.py` runs this file."""

from __future__ import annotations

from math import cos, pi, radians, sin

import bpy
import numpy as np
import pytest
from build_scenes import box

from addon_rfgs.scene.edges import SHARP, SMOOTH, UNSAID, mesh_edges, said_edges
from addon_rfgs.scene.survey import surface_of
from dataset_factory.scene import bundle

pytestmark = pytest.mark.usefixtures("in_room")


def cylinder(sides: int = 12, apart: int = 0) -> bpy.types.Object:
    """Shaded smooth; its ends have one polygon each.

    So many polygons have vertices of their own, as importers of some formats leave them.
    """
    ring = [(0.2 * cos(2 * pi * i / sides), 0.2 * sin(2 * pi * i / sides)) for i in range(sides)]
    points = [(x, y, z) for z in (-0.3, 0.3) for x, y in ring]
    polygons = [[i, (i + 1) % sides, (i + 1) % sides + sides, i + sides] for i in range(sides)]
    polygons += [list(range(sides))[::-1], list(range(sides, 2 * sides))]
    for polygon in polygons[:apart]:
        own = [points[corner] for corner in polygon]
        polygon[:] = range(len(points), len(points) + len(own))
        points += own
    mesh = bpy.data.meshes.new("cylinder")
    mesh.from_pydata(points, [], polygons)
    mesh.shade_smooth()
    item = bpy.data.objects.new("cylinder", mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def rims(mesh: bpy.types.Mesh) -> list[bpy.types.MeshEdge]:
    """Edges around both ends."""
    level = [{round(mesh.vertices[v].co.z, 3) for v in edge.vertices} for edge in mesh.edges]
    return [edge for edge, found in zip(mesh.edges, level, strict=True) if len(found) == 1]


def evaluated(item: bpy.types.Object) -> bpy.types.Mesh:
    bpy.context.view_layer.update()
    return item.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def sharp_places(mesh: bpy.types.Mesh, sides: np.ndarray) -> set[tuple]:
    """Ends of all sharp sides, each edge once, rounded places in order."""
    corners = np.array([triangle.vertices[:] for triangle in mesh.loop_triangles])
    places = [tuple(round(x, 3) for x in vertex.co) for vertex in mesh.vertices]
    return {
        tuple(sorted((places[corners[t, i]], places[corners[t, (i + 1) % 3]])))
        for t, i in np.argwhere(sides == SHARP)
    }


def rim_places(mesh: bpy.types.Mesh) -> set[tuple]:
    places = [tuple(round(x, 3) for x in vertex.co) for vertex in mesh.vertices]
    return {tuple(sorted(places[v] for v in edge.vertices)) for edge in rims(mesh)}


def test_words_are_the_factory_s() -> None:
    assert (UNSAID, SMOOTH, SHARP) == (bundle.UNSAID, bundle.SMOOTH, bundle.SHARP)


@pytest.mark.parametrize("smooth", [False, True])
def test_one_shading_all_over_says_nothing(smooth: bool) -> None:
    item = box("plain", (0, 0, 0), (1, 1, 1))
    item.data.shade_smooth() if smooth else item.data.shade_flat()
    sides = mesh_edges(evaluated(item))
    assert sides.shape == (12, 3) and (sides == UNSAID).all()


def test_marked_edges_are_sharp_and_all_others_smooth() -> None:
    item = cylinder()
    for edge in rims(item.data):
        edge.use_edge_sharp = True
    mesh = evaluated(item)
    sides = mesh_edges(mesh)
    assert set(np.unique(sides)) == {SMOOTH, SHARP}
    assert sharp_places(mesh, sides) == rim_places(mesh)


def test_flat_faces_among_smooth_ones_are_bounded_by_edges() -> None:
    item = cylinder()
    for polygon in item.data.polygons:
        polygon.use_smooth = abs(polygon.normal.z) < 0.5
    mesh = evaluated(item)
    assert sharp_places(mesh, mesh_edges(mesh)) == rim_places(mesh)


def test_smoothing_by_angle_is_heard() -> None:
    """Blender's own operator, whichever of its ways the version has."""
    item = cylinder()
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    bpy.ops.object.shade_smooth_by_angle(angle=radians(40))
    mesh = evaluated(item)
    assert sharp_places(mesh, mesh_edges(mesh)) == rim_places(mesh)


def radial_normals(mesh: bpy.types.Mesh) -> list[tuple]:
    """Normals of a cylinder's corners: round about the mantle, upright on the ends."""
    normals = []
    for polygon in mesh.polygons:
        for vertex in polygon.vertices:
            x, y, _ = mesh.vertices[vertex].co / 0.2
            up = polygon.normal.z
            normals.append((0, 0, up) if abs(up) > 0.5 else (x, y, 0))
    return normals


@pytest.mark.parametrize("apart", [0, 1, 14])
def test_custom_normals_are_followed_across_seams(apart: int) -> None:
    item = cylinder(apart=apart)
    item.data.normals_split_custom_set(radial_normals(item.data))
    mesh = evaluated(item)
    assert mesh.has_custom_normals
    sides = mesh_edges(mesh)
    assert sharp_places(mesh, sides) == rim_places(mesh)
    assert (sides != UNSAID).all()


def test_custom_normals_that_are_flat_all_over_say_nothing() -> None:
    item = cylinder()
    flat = [tuple(p.normal) for p in item.data.polygons for _ in p.vertices]
    item.data.normals_split_custom_set(flat)
    mesh = evaluated(item)
    assert mesh.has_custom_normals and (mesh_edges(mesh) == UNSAID).all()


def test_seams_without_marks_are_smooth() -> None:
    """The rim is marked; one polygon of the mantle is cut out."""
    item = cylinder(apart=1)
    for edge in rims(item.data):
        edge.use_edge_sharp = True
    mesh = evaluated(item)
    assert sharp_places(mesh, mesh_edges(mesh)) == rim_places(mesh)


@pytest.mark.parametrize("scale", [1, -1])
def test_sides_are_those_of_exported_triangles(scale: int) -> None:
    """Negative scale turns triangles round, and their sides with them."""
    item = cylinder()
    for edge in rims(item.data):
        edge.use_edge_sharp = True
    item.scale = (scale, 1, 1)
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    surface = surface_of(scene, item)
    sides = said_edges(scene, [surface])["cylinder"]
    height = surface.vertices[:, 2]
    level = height[surface.faces] == height[np.roll(surface.faces, -1, axis=1)]
    radius = np.hypot(surface.vertices[:, 0], surface.vertices[:, 1])
    middle = (surface.vertices[surface.faces] + np.roll(surface.vertices[surface.faces], -1, 1)) / 2
    # Diagonals of the ends run level too, but further in.
    around = np.hypot(middle[..., 0], middle[..., 1]) > 0.96 * radius.max()
    assert np.array_equal(sides == SHARP, level & around)
