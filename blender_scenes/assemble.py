# SPDX-License-Identifier: GPL-3.0-or-later
"""From an empty file to a saved scene: the steps that all scenes share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

import bpy
import numpy as np

import addon_rfgs
from blender_scenes.catalogue import Scene
from blender_scenes.stage import (
    Point,
    add_access_points,
    add_cameras,
    around_room,
    corners,
    set_render,
    show_first_camera,
)

#: Where the parts of a scene go, in the order of the outliner.
Folders = dict[str, bpy.types.Collection]
FOLDERS = ("Room", "Furniture", "Person", "Stage")


def save_scene(
    out: Path,
    name: str,
    frames: int,
    fps: int,
    fill: Callable[[bpy.types.Scene, Folders], None],
) -> None:
    """Builds a scene from nothing and saves it, compressed, as `out`.

    Args:
        out: The .blend to write.
        name: Name of the scene.
        frames: Number of frames, from 1.
        fps: Frames per second.
        fill: Puts everything into the scene's folders; cameras last (`watch`).
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_rfgs.register()
    try:
        scene = bpy.context.scene
        scene.name = name
        set_render(scene, frames, fps)
        fill(scene, {folder: _collection(folder) for folder in FOLDERS})
        scene.frame_set(scene.frame_start)
        bpy.context.preferences.filepaths.save_version = 0
        bpy.ops.wm.save_as_mainfile(filepath=str(out.resolve()), compress=True)
    finally:
        addon_rfgs.unregister()


def build_scene(wanted: Scene, out: Path) -> None:
    """Builds a scene of the catalogue as `out`; the module of its name tells what is in it."""
    fill = import_module(f"blender_scenes.{wanted.name}").fill
    save_scene(out, wanted.name, wanted.frame_end, wanted.fps, fill)


def set_up(
    scene: bpy.types.Scene,
    folders: Folders,
    half_m: tuple[float, float],
    people: Sequence[bpy.types.Object],
    cameras: Sequence[Point] = (),
) -> None:
    """Access points in a room's corners, and cameras, by default all around, to `watch` people."""
    add_access_points(corners(half_m), (0.0, 0.0), folders["Stage"])
    watch(scene, cameras or around_room(half_m), people, folders["Stage"])


def watch(
    scene: bpy.types.Scene,
    places: Sequence[Point],
    people: Sequence[bpy.types.Object],
    folder: bpy.types.Collection,
) -> None:
    """Adds cameras at `places` that keep all skinned meshes of `people` in view, always."""
    skins = [child for person in people for child in person.children if child.type == "MESH"]
    cameras = add_cameras(places, swept_points(scene, skins), folder)
    show_first_camera(scene, cameras[0])


def swept_points(scene: bpy.types.Scene, skins: Sequence[bpy.types.Object]) -> np.ndarray:
    """Every tenth vertex of each mesh over all frames [m], shape (N, 3)."""
    points = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        for skin in skins:
            evaluated = skin.evaluated_get(graph)
            flat = np.zeros(3 * len(evaluated.data.vertices), dtype=np.float32)
            evaluated.data.vertices.foreach_get("co", flat)
            world = np.array(evaluated.matrix_world)
            points.append(flat.reshape(-1, 3)[::10] @ world[:3, :3].T + world[:3, 3])
    return np.concatenate(points).astype(np.float64)


def _collection(name: str) -> bpy.types.Collection:
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    return made
