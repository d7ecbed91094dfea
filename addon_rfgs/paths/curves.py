# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths as curves: an object per link and frame, a spline per path, a material per level."""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy
import numpy as np

from ..errors import AddonError
from ..gaussians.color_maps import ramp
from ..ownership import collections_of, drop_empty, own_collection
from ..reporting import Progress
from ..scene.frames import unit_scale
from ..timing import key_visibility
from .dataset import PathDataset, Paths

COLLECTION = "RF-GS Paths"
#: Materials are named by this and their level.
MATERIAL = "RF-GS path"
#: Custom property: whose paths an object shows.
LINK = "rfgs_link"
_STATIC = ", static"
#: Levels of power that are told apart by colour.
_LEVELS = 12


@dataclass(frozen=True)
class Selection:
    """Which paths are shown, and how thick."""

    radio: str
    tx_device: int = -1
    """Number of the transmitting device, -1 for all."""
    rx_device: int = -1
    count: int = 200
    """At most so many paths of a link and frame, the strongest."""
    range_db: float = 60.0
    """Paths this much weaker than the strongest one shown are left out [dB]."""
    radius_m: float = 0.004


#: Paths of each frame; None is the scene without anything that moves.
Tables = dict[int | None, Paths]


def chosen(tables: Tables, selection: Selection) -> Tables:
    """The paths of the wanted links that are strong enough, strongest first.

    Strong means the same in every frame, so that levels can be compared.

    Raises:
        AddonError: There is no such path in any frame.
    """
    found = {frame: _of_links(paths, selection) for frame, paths in tables.items()}
    tops = [paths.power_db[0] for paths in found.values() if len(paths)]
    if not tops:
        raise AddonError(
            f"no path from device {selection.tx_device} to device {selection.rx_device}; "
            "-1 stands for all, devices are counted from 0"
        )
    least = max(tops) - selection.range_db
    return {frame: _strongest(paths, least, selection.count) for frame, paths in found.items()}


def _of_links(paths: Paths, selection: Selection) -> Paths:
    keep = np.ones(len(paths), bool)
    for devices, wanted in (
        (paths.tx_device, selection.tx_device),
        (paths.rx_device, selection.rx_device),
    ):
        if wanted >= 0:
            keep &= devices == wanted
    return paths.select(keep)


def _strongest(paths: Paths, least_db: float, count: int) -> Paths:
    """Paths that are strong enough, `count` of each link."""
    found = paths.select(paths.power_db >= least_db)
    # Sorted by power, so the first of each link are its strongest.
    link = found.tx_device.astype(np.int64) * (1 << 31) + found.rx_device
    order = np.argsort(link, kind="stable")
    _, first = np.unique(link[order], return_index=True)
    rank = np.arange(len(order)) - np.repeat(first, np.diff([*first, len(order)]))
    return found.select(np.sort(order[rank < count]))


def show_paths(
    scene: bpy.types.Scene,
    dataset: PathDataset,
    tables: Tables,
    selection: Selection,
    progress: Progress | None = None,
) -> list[bpy.types.Object]:
    """Adds a curve object per link and frame, in place of earlier ones of the same links.

    With several frames each is seen from its own until the next one. Each object carries, in the
    order of its splines, `power_db` and `delay_s` as lists and `interactions` and `objects` as
    JSON; `rfgs_link` says whose paths they are.

    Args:
        scene: Where to.
        dataset: Names devices and objects.
        tables: From `chosen`.
        selection: How they were chosen.
        progress: Called with frames done and in all.

    Returns:
        The objects.
    """
    collection, materials = own_collection(scene, COLLECTION), _materials()
    top = max(float(paths.power_db[0]) for paths in tables.values() if len(paths))
    made: list[tuple[int | None, bpy.types.Object]] = []
    for done, (frame, paths) in enumerate(tables.items(), start=1):
        for link in np.unique(np.stack([paths.tx_device, paths.rx_device], axis=1), axis=0):
            part = paths.select((paths.tx_device == link[0]) & (paths.rx_device == link[1]))
            ends = " to ".join(dataset.device(selection.radio, int(number)) for number in link)
            item = _curve_object(part, _levels(part, top, selection), materials, selection)
            # Corners are metres; the object's scale carries them into the scene's units.
            item.scale = (1 / unit_scale(scene),) * 3
            item[LINK] = f"{selection.radio}: {ends}" + ("" if frame is not None else _STATIC)
            item.rfgs.object_class = "IGNORE"  # A curve with thickness would be traced as a thing.
            item["power_db"] = [float(value) for value in part.power_db]
            item["delay_s"] = [float(value) for value in part.delay_s]
            item["interactions"] = json.dumps([part.interactions(i) for i in range(len(part))])
            item["objects"] = json.dumps([_objects(dataset, part, i) for i in range(len(part))])
            made.append((frame, item))
        if progress:
            progress(done, len(tables))
    links = {item[LINK] for _, item in made}
    _remove([item for item in collection.objects if item.get(LINK) in links])
    for frame, item in made:
        item.name = item[LINK] + ("" if frame is None else f", frame {frame}")
        item.data.name = item.name
        collection.objects.link(item)
    if len(tables) > 1:
        # A frame in which a link is blocked has no object, and ends what was seen before it.
        recorded = [frame for frame in tables if frame is not None]
        framed = [(frame, item) for frame, item in made if frame is not None]
        key_visibility(scene, framed, recorded=recorded)
    return [item for _, item in made]


def _levels(paths: Paths, top_db: float, selection: Selection) -> np.ndarray:
    share = (paths.power_db - (top_db - selection.range_db)) / max(selection.range_db, 1e-9)
    return np.clip(share * _LEVELS, 0, _LEVELS - 1).astype(int)


def clear_paths() -> tuple[int, int]:
    """Removes every path with its curves and materials.

    Returns:
        How many objects there were, and of how many links.
    """
    items = [item for row in collections_of(COLLECTION) for item in row.objects if LINK in item]
    links = {item[LINK].removesuffix(_STATIC) for item in items}
    _remove(items)
    drop_empty(COLLECTION)
    for material in [row for row in bpy.data.materials if row.name.startswith(MATERIAL + " ")]:
        if not material.users:
            bpy.data.materials.remove(material)
    return len(items), len(links)


def _remove(items: list[bpy.types.Object]) -> None:
    """Removes paths with their curves and keys."""
    for item in items:
        curve, motion = item.data, item.animation_data
        action = motion.action if motion else None
        bpy.data.objects.remove(item)
        if not curve.users:
            bpy.data.curves.remove(curve)
        if action is not None and not action.users:
            bpy.data.actions.remove(action)


def _curve_object(
    paths: Paths, levels: np.ndarray, materials: list[bpy.types.Material], selection: Selection
) -> bpy.types.Object:
    curve = bpy.data.curves.new("Paths", "CURVE")
    curve.dimensions = "3D"
    curve.bevel_depth, curve.bevel_resolution = selection.radius_m, 1
    for material in materials:
        curve.materials.append(material)
    for i in range(len(paths)):
        corners = paths.corners(i)
        spline = curve.splines.new("POLY")
        spline.points.add(len(corners) - 1)
        rows = np.concatenate([corners, np.ones((len(corners), 1), np.float32)], axis=1)
        spline.points.foreach_set("co", rows.ravel())
        spline.material_index = int(levels[i])
    return bpy.data.objects.new(curve.name, curve)


def _objects(dataset: PathDataset, paths: Paths, path: int) -> list[str]:
    touched = paths.object[path][paths.kind[path] != 0]
    return [dataset.objects.get(int(number), "") for number in touched]


def _materials() -> list[bpy.types.Material]:
    """One glowing material per level, weakest first; also seen in solid view."""
    colors = ramp(np.arange(_LEVELS, dtype=float) + 1, 0, _LEVELS)
    made = []
    for level, color in enumerate(colors):
        name = f"{MATERIAL} {level + 1:02d}"
        material = bpy.data.materials.get(name) or bpy.data.materials.new(name)
        material.diffuse_color = (*color, 1.0)
        if material.node_tree is None:
            # Blender 5 has nodes from the start.
            material.use_nodes = True
        nodes = material.node_tree.nodes
        nodes.clear()
        glow, out = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
        glow.inputs["Color"].default_value = (*color, 1.0)
        material.node_tree.links.new(glow.outputs[0], out.inputs[0])
        made.append(material)
    return made
