# SPDX-License-Identifier: GPL-3.0-or-later
"""How far Gaussians are from the true surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from ..errors import AddonError
from ..ownership import found_collection, own_collection
from ..scene.frames import unit_scale
from ..scene.state import kept, show_what_renders
from ..scene.survey import Surface, positions, surface_of, survey
from . import attributes
from .cloud_mesh import FRAME
from .clouds import COLLECTION
from .display import Display, shown


@dataclass(frozen=True)
class Comparison:
    """Distances of the Gaussians that are shown to the nearest point of the true surface."""

    mean_m: float
    median_m: float
    count: int
    """Gaussians shown, over all frames."""
    frames: int
    """Frames compared."""

    def lines(self) -> list[str]:
        """The same for a panel, a line each."""
        return [
            f"Median {100 * self.median_m:.1f} cm, mean {100 * self.mean_m:.1f} cm",
            f"{self.count} Gaussians in {self.frames} frame{'s' * (self.frames > 1)}",
        ]

    def sentence(self) -> str:
        """One line for the status bar."""
        return (
            f"Distance to the true mesh: mean {100 * self.mean_m:.1f} cm, median "
            f"{100 * self.median_m:.1f} cm over {self.count} Gaussians in {self.frames} frame(s)"
        )


#: The last result is kept on the collection of the clouds.
_RESULT = "rfgs_compared"


def keep_result(scene: bpy.types.Scene, found: Comparison) -> None:
    """Keeps what was found for the panel; a new import forgets it."""
    own_collection(scene, COLLECTION)[_RESULT] = found.lines()


def kept_result(scene: bpy.types.Scene) -> list[str]:
    """Lines about the last comparison of the clouds that are here; none if there was none."""
    collection = found_collection(scene, COLLECTION)
    return list(collection.get(_RESULT, [])) if collection else []


def compare_with_mesh(
    scene: bpy.types.Scene,
    clouds: Sequence[bpy.types.Object],
    display: Display,
    selected: Sequence[bpy.types.Object] | None = None,
    every_frame: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Writes the distance of every Gaussian [m] into the attribute `error_m` of its cloud.

    Args:
        scene: The scene with the true meshes.
        clouds: Imported Gaussians.
        display: Which of them count for the mean and median.
        selected: The true meshes; None takes what moves within the scene's frames.
        every_frame: All frames that have a cloud, each with the scene at that frame; else only
            the clouds that are seen at the current frame.
        progress: Called with frames done and in all.

    Raises:
        AddonError: There is no true mesh, or no cloud to compare.
    """
    with kept(scene) as keeper:
        frame = scene.frame_current
        tasks = _tasks(scene, clouds, every_frame)
        show_what_renders(keeper, scene)
        surfaces = _true_surfaces(scene, selected)
        distances = []
        for done, (at, items) in enumerate(tasks, start=1):
            scene.frame_set(frame if at is None else at)
            tree = _tree(scene, surfaces)
            distances += [_measure(scene, tree, item)[shown(item, display)] for item in items]
            if progress:
                progress(done, len(tasks))
    counted = np.concatenate(distances)
    if not len(counted):
        raise AddonError("no Gaussian is shown; lower the thresholds or open the crop box")
    return Comparison(float(counted.mean()), float(np.median(counted)), len(counted), len(tasks))


def _tasks(
    scene: bpy.types.Scene, clouds: Sequence[bpy.types.Object], every_frame: bool
) -> list[tuple[int | None, list[bpy.types.Object]]]:
    """Frame to go to, None for the current one, and the clouds to compare there."""
    framed = [item for item in clouds if FRAME in item.data]
    if not framed:
        return [(None, list(clouds))]
    if not every_frame:
        seen = [item for item in framed if not item.hide_viewport]
        if not seen:
            raise AddonError(f"no cloud is seen at frame {scene.frame_current}; go to another")
        return [(None, seen)]
    offset = scene.rfgs.gaussians.frame_offset
    return [(int(item.data[FRAME]) + offset, [item]) for item in framed]


def _true_surfaces(
    scene: bpy.types.Scene, selected: Sequence[bpy.types.Object] | None
) -> list[Surface]:
    if selected is None:
        found = [surface for surface in survey(scene)[0] if surface.moving]
        if not found:
            raise AddonError("no mesh moves in this scene; select the true meshes instead")
        return found
    found = [surface_of(scene, item) for item in selected]
    if not found:
        raise AddonError("no true mesh: select meshes that render, beside the Gaussians")
    return found


def _tree(scene: bpy.types.Scene, surfaces: list[Surface]) -> BVHTree:
    """The surfaces of the current frame, world metres."""
    places = positions(scene, surfaces, scene.frame_current)
    points, faces, first = [], [], 0
    for surface in surfaces:
        points += places[surface.key].tolist()
        faces += (surface.faces + first).tolist()
        first = len(points)
    return BVHTree.FromPolygons(points, faces, all_triangles=True)


def _measure(scene: bpy.types.Scene, tree: BVHTree, item: bpy.types.Object) -> np.ndarray:
    """Distances [M] of a cloud [m], also kept in its mesh."""
    matrix = np.array(item.matrix_world, dtype=np.float64)
    local = attributes.positions(item.data).astype(np.float64)
    places = (local @ matrix[:3, :3].T + matrix[:3, 3]) * unit_scale(scene)
    found = np.array([tree.find_nearest(place)[3] for place in places.tolist()], np.float32)
    attributes.put(item.data, "error_m", "FLOAT", found.reshape(len(places)))
    item.data.update()
    return found.reshape(len(places))
