# SPDX-License-Identifier: GPL-3.0-or-later
"""Every surface of a scene as it renders, and which of them move."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from .errors import AddonError
from .frames import file_label, unit_scale
from .rig import armature_of

#: A mesh moves when some vertex does by more than this within the scene's range [m].
MOVING_M = 1e-3

_SURFACES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


@dataclass
class Surface:
    """One object, or one instance of an object, that has faces."""

    key: str
    """Unique and the same in every frame."""
    source: bpy.types.Object
    """The object that owns the geometry."""
    root: bpy.types.Object
    """The object that puts it into the scene; `source` itself unless instanced."""
    faces: np.ndarray  # [T, 3]
    """Vertex indices of triangles, wound so that normals survive negative scale."""
    slots: np.ndarray  # [T]
    """Material slot of each triangle."""
    materials: list[bpy.types.Material | None]
    """Materials by slot."""
    corners: bytes
    """Fingerprint of the topology."""
    local: np.ndarray = field(repr=False)  # [V, 3]
    matrix: np.ndarray = field(repr=False)  # [4, 4]
    vertices: np.ndarray = field(repr=False)  # [V, 3]
    """World positions [m] in the first frame of the scene's range."""
    armature: bpy.types.Object | None = None
    """The armature it is skinned or parented to."""
    moving: bool = False
    """Whether some vertex moves within the scene's range."""

    @property
    def object_class(self) -> str:
        """Class the user chose, the instancer's choice first."""
        chosen = self.root.rfgs.object_class
        return self.source.rfgs.object_class if chosen == "AUTO" else chosen


def survey(scene: bpy.types.Scene) -> list[Surface]:
    """Finds all surfaces and marks those that move within the scene's whole range.

    The caller has made the viewport show what renders (`state.show_what_renders`).

    Raises:
        AddonError: Topology changes from frame to frame, or something marked static moves.
    """
    scene.frame_set(scene.frame_start)
    surfaces = {found[0]: _first_look(*found) for found in _instances(scene)}
    for frame in range(scene.frame_start + 1, scene.frame_end + 1):
        scene.frame_set(frame)
        seen = set()
        for key, evaluated, matrix, _ in _instances(scene):
            seen.add(key)
            surface = surfaces.get(key)
            if surface is None:
                raise AddonError(_changes(key, frame))
            if not surface.moving:
                local = _read(surface, evaluated, frame)
                surface.moving = _moved(surface, local, matrix, unit_scale(scene))
        if seen != surfaces.keys():
            raise AddonError(_changes(sorted(surfaces.keys() - seen)[0], frame))
    ordered = [surfaces[key] for key in sorted(surfaces)]
    for surface in ordered:
        if surface.moving and surface.object_class == "STATIC":
            raise AddonError(
                f"object {surface.key!r} is marked static but moves; change its class or its motion"
            )
    _refuse_shared_sources(ordered)
    return ordered


def positions(scene: bpy.types.Scene, surfaces: list[Surface], frame: int) -> dict[str, np.ndarray]:
    """World positions [m] of `surfaces` at the current frame, by key, each [V, 3] float64.

    Raises:
        AddonError: A surface is gone or changed its topology.
    """
    wanted = {surface.key: surface for surface in surfaces}
    found = {}
    for key, evaluated, matrix, _ in _instances(scene):
        if key in wanted:
            local = _read(wanted[key], evaluated, frame)
            found[key] = _world(local, matrix, unit_scale(scene))
    missing = sorted(wanted.keys() - found.keys())
    if missing:
        raise AddonError(_changes(missing[0], frame))
    return found


def placements(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """World matrix of every surface at the current frame, by key, Blender units."""
    return {key: matrix for key, _, matrix, _ in _instances(scene)}


@contextmanager
def evaluated_mesh(evaluated: bpy.types.Object) -> Iterator[bpy.types.Mesh]:
    """Yields the mesh an evaluated object ends up with."""
    if isinstance(evaluated.data, bpy.types.Mesh):
        yield evaluated.data
        return
    mesh = evaluated.to_mesh()
    try:
        yield mesh
    finally:
        evaluated.to_mesh_clear()


def _instances(
    scene: bpy.types.Scene,
) -> Iterator[tuple[str, bpy.types.Object, np.ndarray, bpy.types.Object]]:
    """Yields key, evaluated object, world matrix and instancer of everything with faces."""
    graph = bpy.context.evaluated_depsgraph_get()
    seen: dict[str, int] = {}
    for instance in graph.object_instances:
        evaluated = instance.object
        if evaluated.type not in _SURFACES:
            continue
        source = evaluated.original
        root = instance.parent.original if instance.is_instance else source
        if source.hide_render or "IGNORE" in (source.rfgs.object_class, root.rfgs.object_class):
            continue
        with evaluated_mesh(evaluated) as mesh:
            if mesh is None or not len(mesh.polygons):
                continue
        key = source.name if root == source else f"{root.name}/{source.name}"
        count = seen[key] = seen.get(key, 0) + 1
        key = key if count == 1 else f"{key}#{count}"
        yield key, evaluated, np.array(instance.matrix_world, dtype=np.float64), root


def _first_look(
    key: str, evaluated: bpy.types.Object, matrix: np.ndarray, root: bpy.types.Object
) -> Surface:
    source = evaluated.original
    with evaluated_mesh(evaluated) as mesh:
        local = _local(mesh)
        faces, slots = _triangles(mesh)
        corners = _corners(mesh)
        materials = _materials(evaluated, mesh)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1].copy()
    vertices = _world(local, matrix, unit_scale(bpy.context.scene))
    armature = armature_of(source)
    return Surface(
        key, source, root, faces, slots, materials, corners, local, matrix, vertices, armature
    )


def _read(surface: Surface, evaluated: bpy.types.Object, frame: int) -> np.ndarray:
    with evaluated_mesh(evaluated) as mesh:
        if _corners(mesh) != surface.corners:
            raise AddonError(_changes(surface.key, frame))
        return _local(mesh)


def _moved(surface: Surface, local: np.ndarray, matrix: np.ndarray, unit: float) -> bool:
    if np.array_equal(matrix, surface.matrix) and np.array_equal(local, surface.local):
        return False
    shift = _world(local, matrix, unit) - surface.vertices
    return bool((np.linalg.norm(shift, axis=1) > MOVING_M).any())


def _local(mesh: bpy.types.Mesh) -> np.ndarray:
    flat = np.zeros(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def _world(local: np.ndarray, matrix: np.ndarray, unit: float) -> np.ndarray:
    return (local.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]) * unit


def _triangles(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    faces, slots = np.zeros(3 * count, np.int32), np.zeros(count, np.int32)
    mesh.loop_triangles.foreach_get("vertices", faces)
    mesh.loop_triangles.foreach_get("material_index", slots)
    return faces.reshape(-1, 3), slots


def _corners(mesh: bpy.types.Mesh) -> bytes:
    """Vertex count, corners and face starts: equal bytes mean equal topology."""
    corners = np.zeros(len(mesh.loops), np.int32)
    starts = np.zeros(len(mesh.polygons), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    return len(mesh.vertices).to_bytes(8, "little") + corners.tobytes() + starts.tobytes()


def _materials(
    evaluated: bpy.types.Object, mesh: bpy.types.Mesh
) -> list[bpy.types.Material | None]:
    slots = [slot.material for slot in evaluated.material_slots]
    found = []
    for index in range(max(len(slots), len(mesh.materials))):
        material = slots[index] if index < len(slots) else None
        if material is None and index < len(mesh.materials):
            material = mesh.materials[index]
        found.append(None if material is None else material.original)
    return found


def _refuse_shared_sources(surfaces: list[Surface]) -> None:
    """One object cannot carry two instance ids in a rendered mask."""
    users: dict[str, list[Surface]] = {}
    for surface in surfaces:
        users.setdefault(surface.source.name, []).append(surface)
    for name, shared in users.items():
        if len(shared) > 1 and any(surface.moving for surface in shared):
            raise AddonError(
                f"object {name!r} moves and is instanced {len(shared)} times "
                f"({', '.join(surface.key for surface in shared[:3])}); make the instances real "
                "(Object > Apply > Make Instances Real)"
            )


def _changes(key: str, frame: int) -> str:
    return (
        f"object {key!r} of {file_label()} changes its topology at frame {frame}; apply or "
        "disable the modifier that adds or removes faces, or set its class to Ignore"
    )
