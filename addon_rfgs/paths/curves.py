# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths as curves: an object for each link, a spline for each path, a material for each level."""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy
import numpy as np

from ..errors import AddonError
from ..gaussians.color_maps import ramp
from ..scene.frames import unit_scale
from .dataset import PathDataset, Paths

COLLECTION = "RF-GS Paths"
#: Materials are named by this and their level.
MATERIAL = "RF-GS path"
#: Levels of power that are told apart by colour.
_LEVELS = 12


@dataclass(frozen=True)
class Choice:
    """Which paths are shown, and how thick."""

    radio: str
    frame: int | None
    """None is the scene without anything that moves."""
    tx_device: int = -1
    """Number of the transmitting device, -1 for all."""
    rx_device: int = -1
    count: int = 200
    """At most so many paths of a link, the strongest."""
    range_db: float = 60.0
    """Paths this much weaker than the strongest one shown are left out [dB]."""
    radius_m: float = 0.004


def chosen(paths: Paths, choice: Choice) -> Paths:
    """The paths of the wanted links that are strong enough, strongest first.

    Raises:
        AddonError: There is no such path.
    """
    keep = np.ones(len(paths), bool)
    for devices, wanted in (
        (paths.tx_device, choice.tx_device),
        (paths.rx_device, choice.rx_device),
    ):
        if wanted >= 0:
            keep &= devices == wanted
    found = paths.select(keep)
    if not len(found):
        raise AddonError(
            f"no path from device {choice.tx_device} to device {choice.rx_device}; "
            "-1 stands for all, devices are counted from 0"
        )
    found = found.select(found.power_db >= found.power_db[0] - choice.range_db)
    # Sorted by power, so the first of each link are its strongest.
    link = found.tx_device.astype(np.int64) * (1 << 31) + found.rx_device
    order = np.argsort(link, kind="stable")
    _, first = np.unique(link[order], return_index=True)
    rank = np.arange(len(order)) - np.repeat(first, np.diff([*first, len(order)]))
    return found.select(np.sort(order[rank < choice.count]))


def show_paths(
    scene: bpy.types.Scene, dataset: PathDataset, paths: Paths, choice: Choice
) -> list[bpy.types.Object]:
    """Adds a curve object per link; those of the same links, radio and frame are replaced.

    Each object carries, in the order of its splines, `power_db` and `delay_s` as lists and
    `interactions` and `objects` as JSON.

    Returns:
        The objects.
    """
    collection = bpy.data.collections.get(COLLECTION) or bpy.data.collections.new(COLLECTION)
    if collection.name not in scene.collection.children:
        scene.collection.children.link(collection)
    materials = _materials()
    top = float(paths.power_db[0])
    made = []
    for link in np.unique(np.stack([paths.tx_device, paths.rx_device], axis=1), axis=0):
        part = paths.select((paths.tx_device == link[0]) & (paths.rx_device == link[1]))
        ends = " to ".join(dataset.device(choice.radio, int(number)) for number in link)
        when = "static" if choice.frame is None else f"frame {choice.frame}"
        levels = (part.power_db - (top - choice.range_db)) / max(choice.range_db, 1e-9) * _LEVELS
        item = _curve_object(f"{choice.radio}: {ends}, {when}", part, levels, materials, choice)
        # Corners are metres; the object's scale carries them into the scene's units.
        item.scale = (1 / unit_scale(scene),) * 3
        item["power_db"] = [float(value) for value in part.power_db]
        item["delay_s"] = [float(value) for value in part.delay_s]
        item["interactions"] = json.dumps([part.interactions(i) for i in range(len(part))])
        item["objects"] = json.dumps([_objects(dataset, part, i) for i in range(len(part))])
        collection.objects.link(item)
        made.append(item)
    return made


def clear_paths() -> int:
    """Removes every path with its curves and materials.

    Returns:
        How many objects there were.
    """
    collection = bpy.data.collections.get(COLLECTION)
    items = list(collection.objects) if collection else []
    for item in items:
        bpy.data.curves.remove(item.data)
    if collection:
        bpy.data.collections.remove(collection)
    for material in [row for row in bpy.data.materials if row.name.startswith(MATERIAL + " ")]:
        if not material.users:
            bpy.data.materials.remove(material)
    return len(items)


def _curve_object(
    name: str,
    paths: Paths,
    levels: np.ndarray,
    materials: list[bpy.types.Material],
    choice: Choice,
) -> bpy.types.Object:
    old = bpy.data.objects.get(name)
    if (
        old is not None
        and old.type == "CURVE"
        and COLLECTION in {c.name for c in old.users_collection}
    ):
        bpy.data.curves.remove(old.data)
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions = "3D"
    curve.bevel_depth, curve.bevel_resolution = choice.radius_m, 1
    for material in materials:
        curve.materials.append(material)
    for i in range(len(paths)):
        corners = paths.corners(i)
        spline = curve.splines.new("POLY")
        spline.points.add(len(corners) - 1)
        rows = np.concatenate([corners, np.ones((len(corners), 1), np.float32)], axis=1)
        spline.points.foreach_set("co", rows.ravel())
        spline.material_index = int(np.clip(levels[i], 0, _LEVELS - 1))
    return bpy.data.objects.new(name, curve)


def _objects(dataset: PathDataset, paths: Paths, path: int) -> list[str]:
    met = paths.object[path][paths.kind[path] != 0]
    return [dataset.objects.get(int(number), "") for number in met]


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
