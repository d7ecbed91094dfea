# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes scene bundles: what a scene holds, as plain files for the dataset factory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..files import replacing, replacing_folder, sha256_below, write_json
from ..naming import Names
from ..scene.cameras import find_devices, find_views
from ..scene.check import report
from ..scene.content import Content, content_ready
from ..scene.edges import said_edges
from ..scene.findings import refuse
from ..scene.frames import file_label, file_sha256, unit_scale
from ..scene.materials import MaterialTable
from ..scene.overrides import Overrides
from ..scene.people import action_label, joints, segments
from ..scene.state import kept
from ..scene.survey import Surface, positions
from ..seals import write_sealed_json
from .poses import at_offsets, pose_offsets, pose_table
from .velocities import SegmentVelocities, vertex_velocity

SCHEMA = "rfgs-bundle/2"
VERSION = "0.1.0"


def export_bundle(
    scene: bpy.types.Scene,
    folder: Path,
    frames: str | None = None,
    cameras: int | None = None,
    resolution: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    spans_s: list[float] | None = None,
    overrides: Overrides | None = None,
    velocities: bool = False,
) -> dict[str, Any]:
    """Writes the open scene as a bundle.

    Args:
        scene: Scene of the open, saved file.
        folder: Where to; an older bundle there is replaced.
        frames: `A:B[:STEP]`, None for the scene's range.
        cameras: The first so many cameras by name, None for all.
        resolution: Longer side of the pictures [px], None for the scene's.
        progress: Called with (frames done, frames in all).
        spans_s: Times after each frame over which poses are written too [s], see `pose_table`.
        overrides: What the user says about the scene beside the file.
        velocities: Whether the velocity of every vertex is written too.

    Returns:
        What `bundle.json` holds.

    Raises:
        AddonError: The scene cannot be exported; the message says why.
    """
    sha256 = file_sha256()
    # Everything is written beside the old bundle first, so a failed export leaves that as it was.
    with content_ready(scene, frames, overrides or Overrides(), between=bool(spans_s)) as content:
        refuse(file_label(), content.findings)
        with replacing_folder(folder, "bundle.json") as target:
            views, view_guesses = find_views(scene, cameras, resolution, content.ring)
            devices, device_guesses = find_devices(scene, content.overrides.devices)
            content.guesses += view_guesses + device_guesses
            table = MaterialTable(content.overrides)
            objects = _write_objects(target, content, table)
            topology = _write_topology(scene, target, content, table)
            poses = pose_table(scene, spans_s or [])
            offsets_s = pose_offsets(poses)
            _write_frames(scene, target, content, topology, offsets_s, velocities, progress)
            info = _describe(scene, content, sha256)
            info.update({"poses": poses} if poses else {})
            info.update(
                devices=devices,
                cameras=[view.row(unit_scale(scene)) for view in views],
                materials=table.rows,
                objects=objects,
            )
            content.guesses += table.guesses
            write_json(target / "guesses.json", content.guesses)
            write_sealed_json(target / "check.json", report(scene, content, views, devices))
            info["digests"] = sha256_below(target)
            write_sealed_json(target / "bundle.json", info)
    return info


def _describe(scene: bpy.types.Scene, content: Content, sha256: str) -> dict[str, Any]:
    room = content.surroundings()
    return {
        "schema": SCHEMA,
        "blend_name": Path(bpy.data.filepath).stem,
        "blend_sha256": sha256,
        "blender_version": bpy.app.version_string,
        "addon_version": VERSION,
        "fps": scene.render.fps / scene.render.fps_base,
        "frame_start": scene.frame_start,
        "frame_end": scene.frame_end,
        "frames": content.frames,
        "bounds_m": content.bounds.tolist(),
        "room": None if room is None else room.row(),
        "instances": [instance.row() for instance in content.instances],
    }


def _write_objects(target: Path, content: Content, table: MaterialTable) -> list[dict[str, Any]]:
    """Writes static meshes, one PLY per object and material; returns the object table."""
    owner = {surface.key: item for item in content.instances for surface in item.surfaces}
    names, rows = Names(), []
    for number, surface in enumerate(content.surfaces, start=1):
        instance = owner.get(surface.key)
        row = {
            "id": number,
            "name": surface.key,
            "class": instance.kind if instance else "static",
            "instance": instance.id if instance else 0,
            "moving": surface.moving,
            "files": [],
        }
        if not surface.moving:
            safe, indices = names.unique(surface.key), _face_materials(surface, table)
            for index in np.unique(indices):
                name = f"static/{safe}__{table.rows[index]['name']}.ply"
                used, faces = _compact(surface.faces[indices == index])
                write_mesh(target / name, surface.vertices[used], faces)
                row["files"].append(name)
        rows.append(row)
    return rows


def _write_topology(
    scene: bpy.types.Scene, target: Path, content: Content, table: MaterialTable
) -> dict[str, np.ndarray]:
    """Writes `topology.npz`; the rest pose has all armatures of moving things at rest.

    Returns:
        Faces, and material, instance and segment of each.
    """
    owner = {surface.key: item for item in content.instances for surface in item.surfaces}
    parts: dict[str, list[np.ndarray]] = {
        name: [] for name in ("faces", "material", "instance", "segment")
    }
    first = 0
    for surface in content.moving:
        instance = owner[surface.key]
        parts["faces"].append(surface.faces + first)
        parts["material"].append(_face_materials(surface, table))
        parts["instance"].append(np.full(len(surface.faces), instance.id))
        parts["segment"].append(segments(surface, instance.rig))
        first += len(surface.vertices)
    arrays = {name: np.concatenate(values).astype(np.int32) for name, values in parts.items()}
    with kept(scene) as keeper:
        for surface in content.moving:
            if surface.armature is not None:
                keeper.set(surface.armature.data, "pose_position", "REST")
        scene.frame_set(scene.frame_start)
        rest = _moving_vertices(scene, content.moving, scene.frame_start)
        said = said_edges(scene, content.moving)
    edges = np.concatenate([said[surface.key] for surface in content.moving])
    _save_arrays(target / "topology.npz", **arrays, rest_vertices=rest, edges=edges)
    return arrays


def _write_frames(
    scene: bpy.types.Scene,
    target: Path,
    content: Content,
    topology: dict[str, np.ndarray],
    offsets_s: list[float],
    with_velocities: bool,
    progress: Callable[[int, int], None] | None,
) -> None:
    """Writes what moves, frame by frame."""

    def moving(frame: int) -> np.ndarray:
        return _moving_vertices(scene, content.moving, frame)

    people = content.people
    ids = np.array([person.id for person in people], np.int32)
    velocities = SegmentVelocities(scene, people, topology, moving)
    for done, number in enumerate(content.frames, start=1):
        velocity = velocities.at(number)
        of_vertices = vertex_velocity(scene, number, moving) if with_velocities else None
        scene.frame_set(number)
        arrays = {
            "vertices": moving(number),
            "joints": joints(scene, people),
            "segment_velocity": velocity,
            "person_instance": ids,
            "action": np.array([action_label(item, number) for item in people], dtype=np.str_),
        }
        if of_vertices is not None:
            arrays["vertex_velocity"] = of_vertices
        if offsets_s:
            poses = [moving(number) for _ in at_offsets(scene, number, offsets_s)]
            arrays.update(pose_offset_s=np.array(offsets_s), pose_vertices=np.stack(poses))
        _save_arrays(target / "frames" / f"{number:06d}.npz", **arrays)
        if progress:
            progress(done, len(content.frames))


def _moving_vertices(scene: bpy.types.Scene, moving: list[Surface], frame: int) -> np.ndarray:
    found = positions(scene, moving, frame)
    return np.concatenate([found[surface.key] for surface in moving]).astype(np.float32)


def _face_materials(surface: Surface, table: MaterialTable) -> np.ndarray:
    """Row of the material table for each face, [T]."""
    out = np.zeros(len(surface.slots), np.int32)
    for slot in np.unique(surface.slots):
        out[surface.slots == slot] = table.index(surface, int(slot))
    return out


def _compact(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that `faces` [T, 3] use, and the faces renumbered to them."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return used, renumbered.reshape(faces.shape)


def _save_arrays(path: Path, **arrays: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays)


_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_mesh(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Writes vertices [V, 3] in metres and triangles [T, 3]."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), _FACE)
    rows["count"], rows["corners"] = 3, faces
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.write(header.encode("ascii"))
        stream.write(np.ascontiguousarray(vertices, "<f4").tobytes())
        stream.write(rows.tobytes())
