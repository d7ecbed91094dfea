# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns Gaussians on disk into objects: one static cloud and one cloud per frame."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..errors import AddonError
from ..scene.frames import unit_scale
from .nodes import add_modifier
from .ply import Cloud, read_gaussians

#: Collection that holds everything imported.
COLLECTION = "RF-GS Gaussians"

#: Anchors of a perceptually ordered ramp, dark violet to yellow, linear RGB.
_RAMP = np.array(
    [
        [0.06, 0.0, 0.09],
        [0.05, 0.08, 0.26],
        [0.02, 0.28, 0.27],
        [0.11, 0.58, 0.12],
        [0.98, 0.8, 0.02],
    ]
)


@dataclass(frozen=True)
class Display:
    """How imported Gaussians are shown."""

    mode: str = "points"
    opacity_threshold: float = 0.005


@dataclass(frozen=True)
class Imported:
    """What an import made."""

    objects: list[bpy.types.Object]
    frames: list[int]
    count: int


def import_gaussians(scene: bpy.types.Scene, path: Path, display: Display) -> Imported:
    """Brings the Gaussians of a run or a PLY into the scene, in place of earlier ones.

    Args:
        scene: Where to.
        path: A run folder, a folder of `000001.ply` and so on, or one PLY.
        display: How they are shown.

    Raises:
        AddonError: There is nothing to import, or a file is damaged.
    """
    if not 0 <= display.opacity_threshold <= 1:
        raise AddonError(f"opacity threshold: expected 0 to 1, got {display.opacity_threshold}")
    files = _find_files(path)
    clouds = [(frame, read_gaussians(file), _attributes(file)) for frame, file in files]
    collection = _fresh_collection(scene)
    frames = sorted(frame for frame, _, _ in clouds if frame is not None)
    objects = []
    for frame, cloud, extra in clouds:
        item = _make_object(scene, frame, cloud, extra)
        collection.objects.link(item)
        add_modifier(item, display.mode, display.opacity_threshold)
        if frame is not None:
            _show_only_at(item, frame, frames)
        objects.append(item)
    return Imported(objects, frames, sum(len(cloud) for _, cloud, _ in clouds))


def _find_files(path: Path) -> list[tuple[int | None, Path]]:
    """(frame, file) of every cloud; frame None for what is there all the time."""
    if path.is_file():
        return [(None, path)]
    if not path.is_dir():
        raise AddonError(f"{path}: no such run folder or PLY file")
    folder = path / "gaussians" if (path / "gaussians").is_dir() else path
    numbered = sorted(file for file in folder.glob("*.ply") if file.stem.isdigit())
    found: list[tuple[int | None, Path]] = [(int(file.stem), file) for file in numbered]
    if (folder / "static.ply").is_file():
        found.insert(0, (None, folder / "static.ply"))
    if not found and (path / "point_cloud.ply").is_file():
        found = [(None, path / "point_cloud.ply")]
    if not found:
        raise AddonError(f"{path}: no Gaussians; expected gaussians/000001.ply or static.ply")
    return found


def _attributes(file: Path) -> dict[str, np.ndarray]:
    """Radio attributes that lie beside a PLY, if any."""
    beside = file.with_name(file.stem + ".features.npz")
    if not beside.is_file():
        return {}
    try:
        with np.load(beside, allow_pickle=False) as stored:
            names = [name for name in ("rf_power_db", "track_id") if name in stored.files]
            return {name: stored[name] for name in names}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise AddonError(f"{beside}: damaged array file ({error})") from error


def _make_object(
    scene: bpy.types.Scene, frame: int | None, cloud: Cloud, extra: dict[str, np.ndarray]
) -> bpy.types.Object:
    name = "Gaussians static" if frame is None else f"Gaussians {frame:06d}"
    mesh, count = bpy.data.meshes.new(name), len(cloud)
    mesh.vertices.add(count)
    mesh.vertices.foreach_set("co", cloud.means.astype(np.float32).ravel())
    power = extra.get("rf_power_db", np.full(count, -200.0))
    tracks = extra.get("track_id", np.arange(count))
    for key, values in (("rf_power_db", power), ("track_id", tracks)):
        if values.shape != (count,):
            raise AddonError(f"{name}: {key} has shape {values.shape}, the PLY {count} Gaussians")
    power = np.nan_to_num(power.astype(np.float32), nan=-200.0, neginf=-200.0, posinf=200.0)
    colour = _colours(cloud, power if "rf_power_db" in extra else None)
    for key, kind, field, values in (
        ("rfgs_color", "FLOAT_COLOR", "color", colour),
        ("opacity", "FLOAT", "value", cloud.opacities),
        ("scale", "FLOAT_VECTOR", "vector", cloud.scales),
        ("rotation", "QUATERNION", "value", cloud.quats),
        ("radius", "FLOAT", "value", cloud.scales.mean(axis=1)),
        ("rf_power_db", "FLOAT", "value", power),
        ("gid", "INT", "value", tracks.astype(np.int32)),
    ):
        attribute = mesh.attributes.new(key, kind, "POINT")
        attribute.data.foreach_set(field, np.ascontiguousarray(values).ravel())
    mesh.update()
    item = bpy.data.objects.new(name, mesh)
    # Positions are metres; the object's scale carries them into the scene's units.
    item.scale = (1 / unit_scale(scene),) * 3
    item.rfgs.object_class = "IGNORE"
    return item


def _colours(cloud: Cloud, power_db: np.ndarray | None) -> np.ndarray:
    """Linear RGBA [M, 4]; where no colour was fitted (all grey), radio power if it is known."""
    encoded = cloud.colors
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    if power_db is not None and len(cloud) and float(np.ptp(encoded)) < 1e-4:
        low, high = np.percentile(power_db, [5, 99])
        share = np.clip((power_db - low) / max(high - low, 1e-6), 0, 1) * (len(_RAMP) - 1)
        steps = np.arange(len(_RAMP))
        linear = np.stack([np.interp(share, steps, _RAMP[:, i]) for i in range(3)], axis=1)
    return np.concatenate([linear, np.ones((len(cloud), 1))], axis=1).astype(np.float32)


def _fresh_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    """The collection of imports, emptied of an earlier one."""
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
    for item in list(collection.objects):
        mesh = item.data
        bpy.data.objects.remove(item)
        if isinstance(mesh, bpy.types.Mesh) and not mesh.users:
            bpy.data.meshes.remove(mesh)
    if collection.name not in scene.collection.children:
        scene.collection.children.link(collection)
    return collection


def _show_only_at(item: bpy.types.Object, frame: int, frames: list[int]) -> None:
    """Keys visibility from `frame` until the next cloud's; needs no handler and no add-on."""
    later = [other for other in frames if other > frame]
    keys = [(frame - 1, True), (frame, False)] + ([(later[0], True)] if later else [])
    for name in ("hide_viewport", "hide_render"):
        for at, hidden in keys:
            setattr(item, name, hidden)
            item.keyframe_insert(name, frame=at)
