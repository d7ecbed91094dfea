# SPDX-License-Identifier: GPL-3.0-or-later
"""Where meshes say that their surface has an edge: sharp marks, flat faces, custom normals."""

from __future__ import annotations

import bpy
import numpy as np

from .survey import Surface, evaluated_mesh, shown_instances

#: What is said of a side of a triangle: nothing, smooth across it, an edge of the surface.
UNSAID, SMOOTH, SHARP = -1, 0, 1
#: Custom normals that differ by less are the same [deg]; Blender stores them in 16 bits.
_SAME_DEG = 1.0
#: Sides at one edge that are compared with each other; a sheet of two layers has four.
_MOST_AT_AN_EDGE = 4


def said_edges(scene: bpy.types.Scene, surfaces: list[Surface]) -> dict[str, np.ndarray]:
    """What each surface says of its triangles' sides at the current frame, by key, int8 [T, 3].

    Side i leads from corner i of a triangle of `Surface.faces` to the next.
    """
    wanted = {surface.key: surface for surface in surfaces}
    found = {}
    for key, evaluated, _, _ in shown_instances(scene):
        if key in wanted:
            with evaluated_mesh(evaluated) as mesh:
                sides = mesh_edges(mesh)
            # Negative scale has turned the triangles round (`survey.Surface.faces`).
            turned = np.linalg.det(wanted[key].matrix[:3, :3]) < 0
            found[key] = sides[:, [1, 0, 2]] if turned else sides
    return found


def mesh_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """What a mesh says of the sides of its `loop_triangles`, int8 [T, 3].

    Flat or smooth shading all over says nothing, nor do custom normals that are flat all over:
    that is how files without a choice come.
    """
    mesh.calc_loop_triangles()
    loops = _read(mesh.loop_triangles, "loops", 3)
    flat = ~_read(mesh.polygons, "use_smooth", dtype=bool)
    marked = _read(mesh.edges, "use_edge_sharp", dtype=bool)
    polygon = _read(mesh.loop_triangles, "polygon_index")
    unsaid = np.full(loops.shape, UNSAID, np.int8)
    if mesh.has_custom_normals:
        # Marks are no word of their own here: Blender adds them where custom normals part.
        flat_all_over = _flat_all_over(mesh, loops, polygon)
        return unsaid if flat_all_over else _custom_edges(mesh, loops)
    if not marked.any() and flat.all() == flat.any():
        return unsaid
    following = _following(mesh)
    edge = _read(mesh.loops, "edge_index")[loops]
    # The other sides are diagonals of polygons: those are smooth.
    outer = following[loops] == np.roll(loops, -1, axis=1)
    sharp = outer & (marked[edge] | flat[polygon][:, None])
    return np.where(sharp, SHARP, SMOOTH).astype(np.int8)


def _following(mesh: bpy.types.Mesh) -> np.ndarray:
    """Corner after each corner around its polygon, [L]."""
    start, total = (_read(mesh.polygons, name) for name in ("loop_start", "loop_total"))
    out = np.arange(len(mesh.loops)) + 1
    out[start + total - 1] = start
    return out


def _flat_all_over(mesh: bpy.types.Mesh, loops: np.ndarray, polygon: np.ndarray) -> bool:
    """Whether each corner's normal is that of its polygon."""
    corner = _read(mesh.corner_normals, "vector", 3, np.float32)[loops]
    face = _read(mesh.polygon_normals, "vector", 3, np.float32)[polygon]
    return bool(_alike(corner, face[:, None]).all())


def _custom_edges(mesh: bpy.types.Mesh, loops: np.ndarray) -> np.ndarray:
    """Sides on which no neighbour has the same normals are sharp, int8 [T, 3].

    Neighbours are found by place: along a seam a mesh has two vertices at each.
    """
    places = _read(mesh.vertices, "co", 3, np.float32)
    corner = np.unique(places, axis=0, return_inverse=True)[1].ravel()
    corner = corner[_read(mesh.loops, "vertex_index")][loops]
    normals = _read(mesh.corner_normals, "vector", 3, np.float32)[loops]
    first, last = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    at = np.stack([normals, np.roll(normals, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    backwards = first > last
    at[backwards] = at[backwards, ::-1]
    ends = np.sort(np.stack([first, last], axis=1), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    shared, agrees = np.zeros(len(ends), bool), np.zeros(len(ends), bool)
    for step in range(1, _MOST_AT_AN_EDGE):
        one, other = order[:-step], order[step:]
        same = (ends[one] == ends[other]).all(axis=1)
        one, other = one[same], other[same]
        alike = _alike(at[one], at[other]).all(axis=1)
        shared[one], shared[other] = True, True
        agrees[one[alike]], agrees[other[alike]] = True, True
    return np.where(shared & ~agrees, SHARP, SMOOTH).astype(np.int8).reshape(loops.shape)


def _alike(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Whether unit vectors are the same but for rounding, over the last axis."""
    return (one * other).sum(axis=-1) > np.cos(np.radians(_SAME_DEG))


def _read(
    rows: bpy.types.bpy_prop_collection, name: str, width: int = 1, dtype: type = np.int32
) -> np.ndarray:
    """One property of all rows, [N] or [N, width]."""
    flat = np.zeros(len(rows) * width, dtype)
    rows.foreach_get(name, flat)
    return flat.reshape(-1, width) if width > 1 else flat
