# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes scene bundles: what a scene holds, as plain files for the dataset factory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .cameras import cameras_ready, find_devices, find_views
from .errors import AddonError
from .files import replacing, replacing_folder, write_json
from .frames import chosen_frames, file_label, file_sha256, unit_scale
from .lights import light_guesses
from .materials import MaterialTable
from .naming import Names
from .people import Instance, action_label, find_instances, joints, segments
from .ply import write_mesh
from .poses import at_offsets, pose_offsets, pose_table
from .state import kept, show_what_renders
from .survey import Surface, positions, survey
from .velocities import SegmentVelocities

SCHEMA = "rfgs-bundle/1"
VERSION = "0.1.0"


@dataclass
class Content:
    """Everything of a scene that does not depend on the frame."""

    surfaces: list[Surface]
    instances: list[Instance]
    guesses: list[dict[str, Any]]

    @property
    def moving(self) -> list[Surface]:
        """Surfaces that move, in the order of the bundle's vertices."""
        return [surface for surface in self.surfaces if surface.moving]

    @property
    def people(self) -> list[Instance]:
        """People whose joints are known."""
        return [instance for instance in self.instances if instance.rig is not None]

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner [3] in metres of what moves, in the first frame."""
        points = np.concatenate([surface.vertices for surface in self.moving])
        return points.min(axis=0), points.max(axis=0)


def read_content(scene: bpy.types.Scene) -> Content:
    """Surveys a scene.

    Raises:
        AddonError: There is no mesh, or nothing moves.
    """
    surfaces = survey(scene)
    if not surfaces:
        raise AddonError(f"{file_label()}: no mesh that renders; RF-GS needs a scene with people")
    if not any(surface.moving for surface in surfaces):
        raise AddonError(
            f"{file_label()}: no moving mesh in frames {scene.frame_start}:{scene.frame_end}; "
            "RF-GS needs one that moves by more than 1 mm"
        )
    instances, guesses = find_instances(surfaces)
    return Content(surfaces, instances, guesses + _disabled_drivers())


def export_bundle(
    scene: bpy.types.Scene,
    folder: Path,
    frames: str | None = None,
    cameras: int | None = None,
    resolution: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    spans_s: list[float] | None = None,
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

    Returns:
        What `bundle.json` holds.

    Raises:
        AddonError: The scene cannot be exported; the message says why.
    """
    poses = pose_table(scene, spans_s or [])
    numbers, sha256 = chosen_frames(scene, frames, between=bool(poses)), file_sha256()
    # Everything is written beside the old bundle first, so a failed export leaves that as it was.
    with kept(scene) as keeper:
        show_what_renders(keeper, scene)
        content = read_content(scene)
        low, high = (corner / unit_scale(scene) for corner in content.box())
        with (
            cameras_ready(scene, low, high) as camera_guesses,
            replacing_folder(folder, "bundle.json") as target,
        ):
            views, view_guesses = find_views(scene, cameras, resolution)
            devices, device_guesses = find_devices(scene)
            content.guesses += camera_guesses + view_guesses + device_guesses
            content.guesses += light_guesses(scene)
            table = MaterialTable()
            objects = _write_objects(target, content, table)
            topology = _write_topology(scene, target, content, table)
            offsets_s = pose_offsets(poses)
            bounds = _write_frames(scene, target, content, topology, numbers, offsets_s, progress)
            info = _describe(scene, content, numbers, sha256)
            info.update({"poses": poses} if poses else {})
            info.update(
                bounds_m=bounds.tolist(),
                devices=devices,
                cameras=[view.row(unit_scale(scene)) for view in views],
                materials=table.rows,
                objects=objects,
            )
            write_json(target / "guesses.json", content.guesses + table.guesses)
            write_json(target / "bundle.json", info)
    return info


def _describe(
    scene: bpy.types.Scene, content: Content, numbers: list[int], sha256: str
) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "blend_name": Path(bpy.data.filepath).stem,
        "blend_sha256": sha256,
        "blender_version": bpy.app.version_string,
        "addon_version": VERSION,
        "fps": scene.render.fps / scene.render.fps_base,
        "frame_start": scene.frame_start,
        "frame_end": scene.frame_end,
        "frames": numbers,
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
    _save_arrays(target / "topology.npz", **arrays, rest_vertices=rest)
    return arrays


def _write_frames(
    scene: bpy.types.Scene,
    target: Path,
    content: Content,
    topology: dict[str, np.ndarray],
    numbers: list[int],
    offsets_s: list[float],
    progress: Callable[[int, int], None] | None,
) -> np.ndarray:
    """Writes what moves, frame by frame; returns the bounds [2, 3] of the whole scene.

    Bounds come from whole frames alone: asking for poses between them moves no radio.
    """
    people = content.people
    ids = np.array([person.id for person in people], np.int32)
    still = [surface.vertices for surface in content.surfaces if not surface.moving]
    low = np.min([points.min(axis=0) for points in still], axis=0) if still else np.full(3, np.inf)
    high = np.max([points.max(axis=0) for points in still], axis=0) if still else -low
    velocities = SegmentVelocities(
        scene, people, topology, lambda frame: _moving_vertices(scene, content.moving, frame)
    )
    for done, number in enumerate(numbers, start=1):
        velocity = velocities.at(number)
        scene.frame_set(number)
        vertices = _moving_vertices(scene, content.moving, number)
        low = np.minimum(low, vertices.min(axis=0))
        high = np.maximum(high, vertices.max(axis=0))
        arrays = {
            "vertices": vertices,
            "joints": joints(scene, people),
            "segment_velocity": velocity,
            "person_instance": ids,
            "action": np.array([action_label(item, number) for item in people], dtype=np.str_),
        }
        if offsets_s:
            poses = [
                _moving_vertices(scene, content.moving, number)
                for _ in at_offsets(scene, number, offsets_s)
            ]
            arrays.update(pose_offset_s=np.array(offsets_s), pose_vertices=np.stack(poses))
        _save_arrays(target / "frames" / f"{number:06d}.npz", **arrays)
        if progress:
            progress(done, len(numbers))
    return np.stack([low, high]).astype(np.float64)


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


def _disabled_drivers() -> list[dict[str, Any]]:
    """Drivers that need Python, which never runs from a file; their values stay as saved."""
    notes = []
    for owners in (bpy.data.objects, bpy.data.armatures, bpy.data.materials, bpy.data.shape_keys):
        for owner in owners:
            for curve in owner.animation_data.drivers if owner.animation_data else ():
                driver = curve.driver
                if driver.type == "SCRIPTED" and not driver.is_simple_expression:
                    notes.append(
                        {
                            "what": "driver",
                            "object": f"{owner.name}: {curve.data_path}",
                            "value": "disabled",
                            "why": "scripts in a file never run",
                        }
                    )
    return notes
