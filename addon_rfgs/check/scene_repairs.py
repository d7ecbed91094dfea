# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairs of the scene: its unit, its radio materials, where devices stand."""

from __future__ import annotations

import bpy
import numpy as np

from ..devices import authoring, empties
from ..devices.placement import Mesh
from ..errors import AddonError
from ..scene.bands import out_of_band, used_bands
from ..scene.content import content_ready
from ..scene.enclosure import enclosed
from ..scene.frames import file_label, unit_scale
from ..scene.materials import guess
from ..scene.overrides import Overrides
from ..scene.state import kept, show_what_renders
from ..scene.survey import surfaces_now

#: Metres per Blender unit that files are made with.
_UNITS_M = (0.001, 0.01, 0.0254, 0.1, 0.3048, 1.0, 10.0, 100.0, 1000.0)
#: What a person is expected to measure, and what is still believable [m].
_PERSON_M, _SIZES_M = 1.7, (0.5, 2.6)
#: A device is moved by steps of this length [m], up to so many of them.
_STEP_M, _STEPS = 0.05, 80
#: Devices are kept this far inside the scene's bounds [m].
_INSET_M = 0.2


def likely_unit(scene: bpy.types.Scene) -> float:
    """Metres per Blender unit that make what moves as large as a person.

    Raises:
        AddonError: None of the usual units does.
    """
    with content_ready(scene, None, Overrides()) as content:
        rows = content.people or content.instances
        sizes = [
            float(np.ptp(np.concatenate([s.vertices for s in row.surfaces]), axis=0).max())
            for row in rows
        ]
    if not sizes:
        raise AddonError(f"{file_label()}: nothing moves, so nothing tells the unit")
    size = max(sizes) / unit_scale(scene)
    best = min(_UNITS_M, key=lambda unit: abs(np.log(size * unit / _PERSON_M)))
    if not _SIZES_M[0] <= size * best <= _SIZES_M[1]:
        raise AddonError(
            f"{file_label()}: no usual unit makes {size:.3g} units the size of a person; set the "
            "unit scale in the scene properties"
        )
    return best


def set_unit(scene: bpy.types.Scene) -> str:
    """Sets the unit scale that `likely_unit` finds."""
    unit = likely_unit(scene)
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = unit
    return f"1 unit is {unit:g} m now"


def guess_in_band(scene: bpy.types.Scene, name: str) -> str:
    """What a material seems to be by its name and uses.

    Raises:
        AddonError: It is that already, or that is out of band too.
    """
    with kept(scene) as keeper:
        show_what_renders(keeper, scene)
        surfaces = surfaces_now(scene)
    material = bpy.data.materials.get(name)
    users = [row for row in surfaces if material is not None and material in row.materials]
    if not users:
        raise AddonError(f"{file_label()}: material {name!r} is not in use")
    value, _ = guess(users[0], material)
    if material.rfgs.radio_material in ("AUTO", value) or out_of_band(value, used_bands(scene)):
        raise AddonError(f"material {name!r}: its guess, {value}, is no remedy; choose another")
    return value


def set_to_guess(scene: bpy.types.Scene, name: str) -> str:
    """Makes a material what it seems to be."""
    value = guess_in_band(scene, name)
    bpy.data.materials[name].rfgs.radio_material = value
    return f"{name} is {value} now"


def move_device(scene: bpy.types.Scene, name: str) -> str:
    """Moves a device to the nearest free place within the room around the people."""
    item = empties.named_device(scene, name)
    bounds, meshes, room = authoring.scene_space(scene)
    bounds = bounds if room is None else room.box
    unit = unit_scale(scene)
    pose = empties.pose_of(item, unit)
    before = pose[:3, 3].copy()
    pose[:3, 3] = free_place(before, bounds, meshes)
    empties.set_pose(item, pose, unit)
    return f"moved {name} by {np.linalg.norm(pose[:3, 3] - before):.2f} m"


def free_place(place: np.ndarray, bounds: np.ndarray, meshes: list[Mesh]) -> np.ndarray:
    """The nearest place [3] along 18 directions that is in the bounds and in no object [m].

    Raises:
        AddonError: There is none within 4 m.
    """
    inset = np.minimum(_INSET_M, 0.25 * (bounds[1] - bounds[0]))
    low, high = bounds[0] + inset, bounds[1] - inset
    outside = bool((place < bounds[0]).any() or (place > bounds[1]).any())
    start = np.clip(place, low, high) if outside else place
    grid = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
    ways = grid[(np.abs(grid).sum(axis=1) > 0) & (np.abs(grid).sum(axis=1) < 3)]
    ways = ways[np.argsort(np.abs(ways).sum(axis=1), kind="stable")]  # straight before askew
    ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    for step in range(_STEPS + 1):
        way = _STEP_M * (ways if step else np.zeros((1, 3)))
        places = start + step * way
        free = ((places >= np.minimum(low, start)) & (places <= np.maximum(high, start))).all(1)
        # One more step the same way: not right at the surface.
        for spot in (places, places + way):
            free &= ~_inside_any(spot, bounds, meshes)
        if free.any():
            return places[np.flatnonzero(free)[0]]
    raise AddonError("no free place within 4 m; move the device by hand")


def _inside_any(places: np.ndarray, bounds: np.ndarray, meshes: list[Mesh]) -> np.ndarray:
    inside = np.zeros(len(places), dtype=bool)
    for vertices, faces in meshes:
        inside |= enclosed(places, bounds, vertices, faces)
    return inside


def make_alike(scene: bpy.types.Scene) -> str:
    """Gives all devices of the scene's own radio the properties of the first."""
    first = next(item for item in empties.devices(scene) if item.rfgs.radio.strip() == "scene")
    count = authoring.match_devices(scene, first)
    return f"{count} devices are like {first.name} now"
