# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns Gaussians on disk into objects: one static cloud and one cloud per frame."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

from ..array_file import array_file
from ..errors import AddonError
from ..ownership import found_collection, own_collection
from ..scene.frames import unit_scale
from ..seals import check_seal
from ..timing import key_visibility
from .cloud_mesh import FRAME, make_mesh
from .coloring import Coloring, color_clouds
from .display import Display, add_modifier, see_through
from .nodes import GROUP
from .splats import read_gaussians

#: Collection that holds everything imported.
COLLECTION = "RF-GS Gaussians"
#: Blender's timeline ends here.
_LAST_FRAME = 1_048_574


@dataclass(frozen=True)
class Inspection:
    """How clouds are brought in."""

    display: Display = field(default_factory=Display)
    coloring: Coloring = field(default_factory=Coloring)
    frame_offset: int = 0
    """The cloud of frame f is shown at frame f + offset."""
    interpolation: str = "HOLD"
    """What is seen between recorded frames, see `key_visibility`."""
    fall_back: bool = False
    """Colour automatically where no cloud has what the colouring shows, instead of refusing."""


@dataclass(frozen=True)
class Imported:
    """What an import made."""

    objects: list[bpy.types.Object]
    frames: list[int]
    """Frames of the timeline at which clouds appear."""
    count: int
    """Gaussians in all clouds."""
    automatic: str = ""
    """Why colours are automatic and not as wanted."""


def import_gaussians(scene: bpy.types.Scene, path: Path, wanted: Inspection) -> Imported:
    """Brings the Gaussians of a run or a PLY into the scene, in place of earlier ones.

    Args:
        scene: Where to.
        path: A run folder, a folder of `000001.ply` and so on, or one PLY.
        wanted: How they are shown, coloured and timed.

    Raises:
        AddonError: There is nothing to import, or a file is damaged; nothing has changed then.
    """
    meshes: list[bpy.types.Mesh] = []
    try:
        for frame, file in _find_files(path):
            meshes.append(_read_mesh(frame, file))
            # A frame without Gaussians says that nobody is there; a static set says nothing.
            if frame is None and not meshes[-1].vertices:
                bpy.data.meshes.remove(meshes.pop())
        count = sum(len(mesh.vertices) for mesh in meshes)
        if not count:
            raise AddonError(f"{path}: holds no Gaussians (0 points)")
        automatic = _color(meshes, wanted)
    except AddonError:
        for mesh in meshes:
            bpy.data.meshes.remove(mesh)
        raise
    collection = _fresh_collection(scene)
    for name in [name for name in collection.keys() if name.startswith("rfgs_")]:
        del collection[name]  # said of the clouds that were here before
    objects = [_make_object(scene, mesh) for mesh in meshes]
    for item in objects:
        collection.objects.link(item)
        add_modifier(item, wanted.display)
    see_through(scene, wanted.display)
    time_clouds(scene, objects, wanted.frame_offset, wanted.interpolation)
    frames = [mesh[FRAME] + wanted.frame_offset for mesh in meshes if FRAME in mesh]
    return Imported(objects, sorted(frames), count, automatic)


def time_clouds(
    scene: bpy.types.Scene, items: Iterable[bpy.types.Object], offset: int, interpolation: str
) -> None:
    """Keys when each cloud of a frame is visible; those that belong to no frame always are."""
    framed = [(int(item.data[FRAME]), item) for item in items if FRAME in item.data]
    key_visibility(scene, framed, offset, interpolation)


def clouds_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Clouds imported into a scene earlier.

    Raises:
        AddonError: There are none.
    """
    found = clouds_here(scene)
    if not found:
        raise AddonError(f"the scene {scene.name!r} has no imported Gaussians; import some first")
    return found


def clouds_here(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Clouds imported into a scene earlier, if any."""
    collection = found_collection(scene, COLLECTION)
    items = collection.objects if collection else []
    return [item for item in items if item.type == "MESH" and GROUP in item.modifiers]


def path_or_run(scene: bpy.types.Scene) -> str:
    """The path of the panel, or the folder of its training where that is done; empty if neither."""
    return str(scene.rfgs.gaussians.path) or trained_run(scene)


def trained_run(scene: bpy.types.Scene) -> str:
    """The folder of the panel's training where that is done; empty if it is not."""
    folder = scene.rfgs.jobs.run_folder
    if folder.startswith("//") and not bpy.data.filepath:
        return ""
    return folder if (Path(bpy.path.abspath(folder)) / "point_cloud.ply").is_file() else ""


def chosen_clouds(context: bpy.types.Context, *, selected: bool = True) -> list[bpy.types.Object]:
    """The selected clouds if they are wanted, else all that are seen at this frame."""
    items = clouds_of(context.scene)
    chosen = [item for item in items if selected and item in context.selected_objects]
    return chosen or [item for item in items if not item.hide_viewport]


def _find_files(path: Path) -> list[tuple[int | None, Path]]:
    """(frame, file) of every cloud; frame None for what is there all the time."""
    if path.is_file():
        return [(None, path)]
    if not path.is_dir():
        raise AddonError(f"{path}: no such run folder or PLY file")
    folder = path / "gaussians" if (path / "gaussians").is_dir() else path
    numbered = [file for file in folder.glob("*.ply") if re.fullmatch(r"[0-9]{1,9}", file.stem)]
    found: list[tuple[int | None, Path]] = [(int(file.stem), file) for file in sorted(numbered)]
    frames = [int(file.stem) for file in numbered]
    if max(frames, default=0) > _LAST_FRAME or len(set(frames)) < len(frames):
        raise AddonError(f"{folder}: two files of one frame, or a frame beyond {_LAST_FRAME}")
    if (folder / "static.ply").is_file():
        found.insert(0, (None, folder / "static.ply"))
    if not found and (path / "point_cloud.ply").is_file():
        found = [(None, path / "point_cloud.ply")]
    if not found:
        raise AddonError(f"{path}: no Gaussians; expected gaussians/000001.ply or static.ply")
    return found


def _read_mesh(frame: int | None, file: Path) -> bpy.types.Mesh:
    cloud = read_gaussians(file)
    return make_mesh(frame, cloud, read_features(file, len(cloud)))


def _color(meshes: list[bpy.types.Mesh], wanted: Inspection) -> str:
    """Colours clouds; returns why automatically and not as wanted, empty if as wanted."""
    try:
        color_clouds(meshes, wanted.coloring)
    except AddonError as error:
        if not wanted.fall_back:
            raise
        color_clouds(meshes, Coloring())
        return str(error)
    return ""


def _make_object(scene: bpy.types.Scene, mesh: bpy.types.Mesh) -> bpy.types.Object:
    mesh.name = f"Gaussians {mesh[FRAME]:06d}" if FRAME in mesh else "Gaussians static"
    item = bpy.data.objects.new(mesh.name, mesh)
    # Positions are metres; the object's scale carries them into the scene's units.
    item.scale = (1 / unit_scale(scene),) * 3
    item.rfgs.object_class = "IGNORE"
    return item


def _fresh_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    """The collection of imports, emptied of an earlier one; what a user put there stays."""
    collection = own_collection(scene, COLLECTION)
    for item in [item for item in collection.objects if GROUP in item.modifiers]:
        mesh = item.data
        bpy.data.objects.remove(item)
        if isinstance(mesh, bpy.types.Mesh) and not mesh.users:
            bpy.data.meshes.remove(mesh)
    return collection


#: Array → kinds of numbers it may hold, and whether it has a second axis.
_ARRAYS = {
    "features": ("f", True),
    "gamma": ("c", True),
    "rf_power_db": ("f", False),
    "track_id": ("iu", False),
    "body": ("iu", False),
    "error_m": ("f", False),
    "bone": ("iu", False),
    "sigma_m": ("f", False),
}
#: Most numbers per Gaussian of one array.
_MAX_WIDTH = 256


def read_features(ply: Path, count: int) -> dict[str, np.ndarray]:
    """Arrays of `<name>.features.npz` beside a PLY, those that are there; rows as in the PLY.

    `features` is [M, F], `gamma` complex [M, K] (one value, or one per knot of the band),
    the others [M]. Nothing is unpickled, and nothing is allocated before its size is checked.

    Raises:
        AddonError: The file is damaged or does not belong to the PLY, or one of them has changed
            since it was written.
    """
    path = ply.with_name(ply.stem + ".features.npz")
    if not path.is_file():
        return {}
    for file in (ply, path):
        check_seal(file, "delete what is damaged and run the same `rfgs train` again")
    with array_file(path) as arrays:
        return {
            name: arrays.read(name, lambda *found, name=name: _check(path, name, count, *found))
            for name in _ARRAYS
            if name in arrays
        }


def _check(path: Path, name: str, count: int, shape: tuple[int, ...], dtype: np.dtype) -> None:
    kinds, wide = _ARRAYS[name]
    if len(shape) != 1 + wide or shape[0] != count or max(shape[1:], default=1) > _MAX_WIDTH:
        raise AddonError(f"{path}: {name} has shape {list(shape)}; the PLY holds {count} Gaussians")
    if dtype.kind not in kinds:
        raise AddonError(f"{path}: {name} holds {dtype}, which it cannot be")
