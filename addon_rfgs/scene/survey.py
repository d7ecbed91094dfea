# SPDX-License-Identifier: GPL-3.0-or-later
"""Every surface of a scene as it renders, and which of them move."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..errors import AddonError
from .findings import Finding
from .frames import file_label, unit_scale
from .rig import armature_of

#: A mesh moves when some vertex does by more than this within the scene's range [m].
MOVING_M = 1e-3

_SURFACES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
#: Ways in which an object repeats its children in place of showing them.
_REPEATING = {"VERTS", "FACES"}


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
    low: np.ndarray = field(default_factory=lambda: np.full(3, np.inf))
    """Lower corner [3] of where it is within the range [m]."""
    high: np.ndarray = field(default_factory=lambda: np.full(3, -np.inf))
    """Upper corner [3]."""
    boxes: list[np.ndarray] = field(default_factory=list, repr=False)
    """Both corners [2, 3] in the first frame, and in each in which it stands elsewhere [m]."""

    def material(self, slot: int) -> bpy.types.Material | None:
        """Material of a slot; faces beyond the last slot use the last, as Blender shows them."""
        return self.materials[min(slot, len(self.materials) - 1)] if self.materials else None

    @property
    def object_class(self) -> str:
        """Class the user chose, the instancer's choice first."""
        chosen = self.root.rfgs.object_class
        return self.source.rfgs.object_class if chosen == "AUTO" else chosen


def survey(
    scene: bpy.types.Scene, moving: Collection[str] = ()
) -> tuple[list[Surface], list[Finding]]:
    """Finds all surfaces and marks those that move within the scene's whole range.

    The caller has made the viewport show what renders (`state.show_what_renders`).

    Args:
        scene: The scene.
        moving: Names of objects that count as moving although they may keep still.

    Returns:
        Surfaces by key, those left out whose topology changes, and what is wrong with any.
    """
    scene.frame_set(scene.frame_start)
    surfaces = {found[0]: _first_look(*found) for found in shown_instances(scene)}
    changed: dict[str, Finding] = {}
    for frame in range(scene.frame_start + 1, scene.frame_end + 1):
        scene.frame_set(frame)
        seen = set()
        for key, evaluated, matrix, root in shown_instances(scene):
            seen.add(key)
            surface = surfaces.get(key)
            if surface is None:
                changed.setdefault(key, _comes_and_goes(key, root, "appears", frame))
            elif key not in changed:
                local = _read(surface, evaluated)
                if local is None:
                    changed[key] = _other_topology(key, frame)
                else:
                    _follow(surface, local, matrix, unit_scale(scene))
        for key in sorted(surfaces.keys() - seen):
            root = surfaces[key].root
            changed.setdefault(key, _comes_and_goes(key, root, "disappears", frame))
    ordered = [surfaces[key] for key in sorted(surfaces.keys() - changed.keys())]
    for surface in ordered:
        surface.moving |= bool({surface.source.name, surface.root.name} & set(moving))
    marked = [
        Finding("error", surface.key, "is marked static but moves", "change its class or motion")
        for surface in ordered
        if surface.moving and surface.object_class == "STATIC"
    ]
    return ordered, [*changed.values(), *marked]


def surfaces_now(scene: bpy.types.Scene) -> list[Surface]:
    """All surfaces by key as they are at the current frame, none known to move."""
    found = {item[0]: _first_look(*item) for item in shown_instances(scene)}
    return [found[key] for key in sorted(found)]


def surface_of(scene: bpy.types.Scene, item: bpy.types.Object) -> Surface:
    """The surface of one object at the current frame.

    Raises:
        AddonError: It has no faces that render.
    """
    for found in shown_instances(scene):
        if found[3] == item:
            return _first_look(*found)
    raise AddonError(f"{item.name}: has no faces that render at frame {scene.frame_current}")


def positions(scene: bpy.types.Scene, surfaces: list[Surface], frame: int) -> dict[str, np.ndarray]:
    """World positions [m] of `surfaces` at the current frame, by key, each [V, 3] float64.

    Raises:
        AddonError: A surface is gone or changed its topology.
    """
    wanted = {surface.key: surface for surface in surfaces}
    found = {}
    for key, evaluated, matrix, _ in shown_instances(scene):
        if key in wanted:
            local = _read(wanted[key], evaluated)
            if local is not None:
                found[key] = _world(local, matrix, unit_scale(scene))
    missing = sorted(wanted.keys() - found.keys())
    if missing:
        raise AddonError(f"{file_label()}: {_other_topology(missing[0], frame).sentence}")
    return found


def placements(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """World matrix of every surface at the current frame, by key, Blender units."""
    return {key: matrix for key, _, matrix, _ in shown_instances(scene)}


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


def shown_instances(
    scene: bpy.types.Scene,
) -> Iterator[tuple[str, bpy.types.Object, np.ndarray, bpy.types.Object]]:
    """Yields key, evaluated object, world matrix and instancer of everything with faces."""
    graph = bpy.context.evaluated_depsgraph_get()
    seen: dict[str, int] = {}
    converted: set[tuple[str, int, int]] = set()
    for instance in graph.object_instances:
        evaluated = instance.object
        if evaluated.type not in _SURFACES:
            continue
        source = evaluated.original
        root = instance.parent.original if instance.is_instance else source
        if source.hide_render or root.hide_render:
            continue
        if root == source and source.parent and source.parent.instance_type in _REPEATING:
            continue  # Only its copies render.
        if "IGNORE" in (source.rfgs.object_class, root.rfgs.object_class):
            continue
        with evaluated_mesh(evaluated) as mesh:
            if mesh is None or not len(mesh.polygons):
                continue
            # Curves and texts come twice: as themselves, and as the mesh they become.
            size = (source.name, len(mesh.vertices), len(mesh.polygons))
        if evaluated.type != "MESH":
            converted.add(size)
        elif root == source and size in converted:
            converted.remove(size)
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
        (faces, slots), local, corners = _triangles(mesh), _local(mesh), _corners(mesh)
        materials = _materials(evaluated, mesh)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1].copy()
    vertices = _world(local, matrix, unit_scale(bpy.context.scene))
    box = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    return Surface(
        key=key,
        source=source,
        root=root,
        faces=faces,
        slots=slots,
        materials=materials,
        corners=corners,
        local=local,
        matrix=matrix,
        vertices=vertices,
        armature=armature_of(source),
        low=box[0],
        high=box[1],
        boxes=[box],
    )


def _read(surface: Surface, evaluated: bpy.types.Object) -> np.ndarray | None:
    """Vertices in the object's own axes, None if the topology is another."""
    with evaluated_mesh(evaluated) as mesh:
        return _local(mesh) if _corners(mesh) == surface.corners else None


def _follow(surface: Surface, local: np.ndarray, matrix: np.ndarray, unit: float) -> None:
    """Notes where a surface is at a later frame."""
    if np.array_equal(matrix, surface.matrix) and np.array_equal(local, surface.local):
        return
    vertices = _world(local, matrix, unit)
    box = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    surface.boxes.append(box)
    surface.low, surface.high = np.minimum(surface.low, box[0]), np.maximum(surface.high, box[1])
    shift = vertices - surface.vertices
    surface.moving |= bool((np.linalg.norm(shift, axis=1) > MOVING_M).any())


def _local(mesh: bpy.types.Mesh) -> np.ndarray:
    flat = np.zeros(3 * len(mesh.vertices), dtype=np.float32)
    # Attributes are copied whole, where `vertices` and `loops` hand out number by number; but in
    # edit mode these are absent.
    stored = mesh.attributes.get("position")
    if stored is not None:
        stored.data.foreach_get("vector", flat)
    else:
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
    stored = mesh.attributes.get(".corner_vert")
    if stored is not None:
        stored.data.foreach_get("value", corners)
    else:
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


def _comes_and_goes(key: str, root: bpy.types.Object, verb: str, frame: int) -> Finding:
    emits = any(system.settings.type == "EMITTER" for system in root.particle_systems)
    why = "comes from particles" if emits else "has animated visibility or an animated count"
    return Finding(
        "error",
        key,
        f"{verb} at frame {frame}, so the topology changes; it {why}",
        "keep it throughout, choose frames in which it stays, or drop it (class Ignore)",
    )


def _other_topology(key: str, frame: int) -> Finding:
    return Finding(
        "error",
        key,
        f"changes its topology at frame {frame}",
        "apply or disable the modifier that adds or removes faces, or drop it (class Ignore)",
    )
