# SPDX-License-Identifier: Apache-2.0
"""Reads scene bundles: what Blender knows about a scene, as plain files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dataset_factory.scene.bundle_rows import BundleRows
from dataset_factory.scene.room import Room, room_of_row
from rfgs_core.arrays import Shape, load_arrays
from rfgs_core.dataset.mesh_ply import read_mesh
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import inside, sha256
from rfgs_core.records import record
from rfgs_core.seals import read_sealed_json
from rfgs_core.simulate.surface.edges import SHARP, SMOOTH, UNSAID

SCHEMA = "rfgs-bundle/2"
NUM_JOINTS = 17

_REMEDY = "export the scene again"
_FRAME: dict[str, Shape | None] = {
    "vertices": ("vertex", 3),
    "joints": ("person", NUM_JOINTS, 3),
    "segment_velocity": ("person", NUM_JOINTS, 3),
    "person_instance": ("person",),
    "action": None,
}
_TOPOLOGY: dict[str, Shape | None] = {
    "faces": ("face", 3),
    "material": ("face",),
    "instance": ("face",),
    "segment": ("face",),
    "rest_vertices": ("vertex", 3),
}
_TYPES = {
    **dict.fromkeys(("vertices", "rest_vertices", "joints", "segment_velocity"), "f4 f8"),
    **dict.fromkeys(("faces", "material", "instance", "segment", "person_instance"), "i4 i8"),
    "edges": "i1",
    "action": "U",
}


@dataclass(frozen=True)
class Topology:
    """What stays the same in every frame about everything that moves."""

    faces: np.ndarray
    """Vertex indices of each triangle, int32, shape (T, 3)."""
    material: np.ndarray
    """Index into the bundle's materials of each triangle, int32, shape (T,)."""
    instance: np.ndarray
    """Instance id of each triangle, int32, shape (T,)."""
    segment: np.ndarray
    """Joint of `rfgs_core.skeleton` that each triangle follows or -1, int32, shape (T,)."""
    rest_vertices: np.ndarray
    """Vertices in the rest pose [m], float32, shape (V, 3)."""
    edges: np.ndarray
    """Whether the side from each corner of a triangle to the next is an edge of the surface, as
    far as the mesh says so: `SHARP`, `SMOOTH` or `UNSAID`, int8, shape (T, 3)."""


@dataclass(frozen=True)
class BundleFrame:
    """Everything that moves, at one frame."""

    frame: int
    """Blender frame number."""
    vertices: np.ndarray
    """World positions [m], float32, shape (V, 3)."""
    joints: np.ndarray
    """Joint positions of each person [m], float32, shape (P, 17, 3); NaN where unknown."""
    segment_velocity: np.ndarray
    """Velocity of the centre of each body segment's skin [m/s], float32, shape (P, 17, 3); NaN
    where joints are unknown."""
    person_instance: np.ndarray
    """Instance id of each person, int32, shape (P,)."""
    action: np.ndarray
    """Action label of each person, shape (P,), strings."""


@dataclass(frozen=True)
class StaticMesh:
    """One (object, material) pair of the static scene."""

    name: str
    """File name without suffix, `<object>__<material>`."""
    material_index: int
    """Index into the bundle's materials."""
    vertices: np.ndarray
    """World positions [m], float32, shape (V, 3)."""
    faces: np.ndarray
    """Vertex indices of each triangle, int32, shape (T, 3)."""


@dataclass(frozen=True)
class Bundle:
    """A scene bundle on disk."""

    path: Path
    """Folder of the bundle."""
    info: dict[str, Any]
    """All of `bundle.json`."""
    devices: list[dict[str, Any]]
    """Radio devices the scene brings."""
    cameras: list[dict[str, Any]]
    """Cameras by name."""
    materials: list[dict[str, Any]]
    """Materials that faces refer to by index."""
    objects: list[dict[str, Any]]
    """Objects of the scene."""
    instances: list[dict[str, Any]]
    """Instances, ids from 1; 0 is everything static."""
    topology: Topology
    """Triangles of everything that moves."""
    bounds_m: np.ndarray
    """Minimum and maximum of the scene over its frames [m], shape (2, 3)."""
    frames: list[int]
    """Frames that were exported."""
    fps: float
    """Frames per second."""
    room: Room | None = None
    """The room around the people; None where nothing stands still."""

    @property
    def room_m(self) -> np.ndarray:
        """Box of the room around the people, else the scene's bounds [m], shape (2, 3)."""
        return self.bounds_m if self.room is None else self.room.box_m

    def file(self, name: str) -> Path:
        """A file of the bundle, as it was exported.

        Raises:
            RfgsFormatError: It is missing, has changed, or bundle.json does not name it.
        """
        return _unchanged(self.path, name, self.info["digests"])

    def frame_file(self, frame: int) -> Path:
        """The file of a frame, as it was exported; refused like `file`."""
        return self.file(frame_file(Path(), frame).as_posix())

    def frame(self, frame: int) -> BundleFrame:
        """Reads what moves at one frame.

        Raises:
            RfgsFormatError: The file is missing, damaged or does not fit the topology.
        """
        path = self.frame_file(frame)
        unknown = ("joints", "segment_velocity")
        arrays = load_arrays(path, _REMEDY, _FRAME, unknown, types=_TYPES, seal=False)
        vertices, people = arrays["vertices"], len(arrays["person_instance"])
        _expect(path, "vertices", vertices, self.topology.rest_vertices.shape)
        _expect(path, "action", arrays["action"], (people,))
        return BundleFrame(
            frame=frame,
            vertices=vertices.astype(np.float32),
            joints=arrays["joints"].astype(np.float32),
            segment_velocity=arrays["segment_velocity"].astype(np.float32),
            person_instance=arrays["person_instance"].astype(np.int32),
            action=arrays["action"].astype(str),
        )

    @property
    def path_objects(self) -> list[dict[str, Any]]:
        """What paths can meet: each static object, then each moving instance, ids from 1."""
        still = [
            {"name": row["name"], "class": "static", "instance": 0}
            for row in self.objects
            if row["files"]
        ]
        moving = [
            {"name": row["name"], "class": row["class"], "instance": row["id"]}
            for row in self.instances
        ]
        return [{"id": number, **row} for number, row in enumerate([*still, *moving], start=1)]

    def static_meshes(self) -> list[StaticMesh]:
        """Reads every static mesh, in the order of the object table.

        Raises:
            RfgsFormatError: A mesh is missing, damaged or of an unknown material.
        """
        by_name = {sanitised(row["name"]): index for index, row in enumerate(self.materials)}
        meshes = []
        for row in self.objects:
            for name in row["files"]:
                path = self.file(name)
                # Material names may hold the separator themselves: the longest fit is meant.
                fits = [known for known in by_name if path.stem.endswith(f"__{known}")]
                if not fits:
                    raise RfgsFormatError(
                        f"{path}: expected a name <object>__<material> with a material of "
                        "bundle.json"
                    )
                material = max(fits, key=len)
                vertices, faces = read_mesh(path)
                meshes.append(StaticMesh(path.stem, by_name[material], vertices, faces))
        return meshes


def unknown_joints(joints: np.ndarray) -> np.ndarray:
    """Which people have no joints: all NaN, as bundles write it; bool, shape (P,), P may be 0."""
    return np.isnan(joints).all(axis=tuple(range(1, joints.ndim)))


def sanitised(name: str) -> str:
    """A name as bundles spell it in file names: only letters, digits, `_` and `-`."""
    return "".join(
        char if char.isascii() and (char.isalnum() or char in "_-") else "_" for char in name
    )


def frame_file(bundle: Path, frame: int) -> Path:
    """Where a bundle keeps what moves at a frame."""
    return bundle / "frames" / f"{frame:06d}.npz"


def read_bundle(path: Path) -> Bundle:
    """Opens a scene bundle and checks that it holds what its schema promises.

    Args:
        path: Folder with `bundle.json`.

    Returns:
        The bundle; frames and static meshes are read when asked for.

    Raises:
        RfgsError: There is no such bundle.
        RfgsFormatError: A file is damaged, of another schema or contradicts another.
    """
    path = Path(path)
    file = path / "bundle.json"
    info = read_sealed_json(file, _REMEDY)
    _check_info(file, info)
    bounds = np.asarray(info["bounds_m"], dtype=np.float64)
    if (bounds[1] < bounds[0]).any():
        raise RfgsFormatError(f"{file}: bounds_m: expected [[min xyz], [max xyz]], got {bounds}")
    topology = _read_topology(_unchanged(path, "topology.npz", info["digests"]), info)
    return Bundle(
        path=path,
        info=info,
        devices=info["devices"],
        cameras=info["cameras"],
        materials=info["materials"],
        objects=info["objects"],
        instances=info["instances"],
        topology=topology,
        bounds_m=bounds,
        frames=[int(frame) for frame in info["frames"]],
        fps=float(info["fps"]),
        room=room_of_row(info.get("room")),
    )


def _check_info(file: Path, info: dict[str, Any]) -> None:
    if info.get("schema") != SCHEMA:
        raise RfgsFormatError(f"{file}: expected schema {SCHEMA!r}, got {info.get('schema')!r}")
    record(file, info, BundleRows)


def _unchanged(bundle: Path, name: str, digests: dict[str, str]) -> Path:
    """A file of a bundle that has the digest it was exported with."""
    path = inside(bundle, name)
    if name not in digests or not path.is_file():
        what = "no such file" if name in digests else "bundle.json does not name it"
        raise RfgsFormatError(f"{path}: {what}; {_REMEDY}")
    if sha256(path) != digests[name]:
        raise RfgsFormatError(f"{path}: changed or damaged since the export; {_REMEDY}")
    return path


def _read_topology(path: Path, info: dict[str, Any]) -> Topology:
    arrays = load_arrays(path, _REMEDY, _TOPOLOGY, types=_TYPES, others=True, seal=False)
    faces, vertices = arrays["faces"], arrays["rest_vertices"]
    edges = arrays.get("edges", np.full((len(faces), 3), UNSAID))
    _expect(path, "edges", edges, (len(faces), 3))
    if not np.isin(edges, (UNSAID, SMOOTH, SHARP)).all():
        raise RfgsFormatError(f"{path}: edges: expected {UNSAID}, {SMOOTH} or {SHARP}")
    instances = {row["id"] for row in info["instances"]}
    limits = {"faces": len(vertices), "material": len(info["materials"])}
    for name, limit in limits.items():
        values = arrays[name]
        if values.size and not 0 <= values.min() <= values.max() < limit:
            raise RfgsFormatError(f"{path}: {name}: expected indices below {limit}")
    if not set(np.unique(arrays["instance"]).tolist()) <= instances:
        raise RfgsFormatError(f"{path}: instance: expected ids of the table in bundle.json")
    return Topology(
        faces=faces.astype(np.int32),
        material=arrays["material"].astype(np.int32),
        instance=arrays["instance"].astype(np.int32),
        segment=arrays["segment"].astype(np.int32),
        rest_vertices=vertices.astype(np.float32),
        edges=edges.astype(np.int8),
    )


def _expect(path: Path, name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise RfgsFormatError(f"{path}: {name}: expected shape {shape}, got {array.shape}")
