# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of path gains as a coloured surface, a corner for each cell's middle."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..errors import AddonError
from ..gaussians import attributes
from ..gaussians.color_maps import found_range, ramp
from ..gaussians.coloring import COLOR_ATTRIBUTE, SCALE
from ..gaussians.legend import COVERAGE as COLLECTION
from ..gaussians.look import material
from ..json_file import Fields, read_json
from ..ownership import collections_of, drop_empty, found_collection, own_collection
from ..scene.frames import unit_scale

#: Custom property: marks what this module made, and says of whom.
OF = "rfgs_coverage"
#: Gains below this are those of cells that no ray reaches [dB].
_NOTHING_DB = -299.0
_MOST_CELLS, _LARGEST_JSON = 4_000_000, 400_000_000
_REMEDY = "make it anew with: rfgs-factory coverage"
_FORM = Fields(
    {"radio": str, "cell_m": float, "corner_m": [float], "devices": [str], "gain_db": [[[float]]]}
)


@dataclass(frozen=True)
class CoverageMap:
    """What `rfgs-factory coverage` wrote."""

    radio: str
    corner_m: np.ndarray
    """Corner of the first cell, and the height of the plane [m], [3]."""
    cell_m: float
    devices: list[str]
    gain_db: np.ndarray
    """Path gain to an isotropic antenna [dB], [tx, y, x]; NaN where no ray arrives."""

    def of(self, number: int) -> tuple[str, np.ndarray]:
        """Name of a transmitter and its gains [y, x]; -1: the loudest of all in each cell.

        Raises:
            AddonError: There is no such transmitter.
        """
        if number >= len(self.devices):
            last = len(self.devices) - 1
            raise AddonError(f"no transmitter {number}; they are counted from 0 to {last}")
        if number >= 0:
            return self.devices[number], self.gain_db[number]
        return "loudest", np.fmax.reduce(self.gain_db, axis=0)


def read_map(file: Path) -> CoverageMap:
    """Reads a map.

    Raises:
        AddonError: It is missing, or is none.
    """
    info = read_json(file, _FORM, _REMEDY, _LARGEST_JSON)
    try:
        gain_db = np.array(info["gain_db"], dtype=np.float64)
    except ValueError as error:
        raise AddonError(f"{file}: gain_db: rows of different length; {_REMEDY}") from error
    fits = gain_db.ndim == 3 and 0 < gain_db.size <= _MOST_CELLS and min(gain_db.shape[1:]) > 1
    corner_m = np.array(info["corner_m"], dtype=np.float64)
    if not fits or len(gain_db) != len(info["devices"]) or corner_m.shape != (3,):
        raise AddonError(f"{file}: expected a map of several cells for each device; {_REMEDY}")
    if not info["cell_m"] > 0.0:
        raise AddonError(f"{file}: cell_m: expected a side over 0 m; {_REMEDY}")
    gain_db[gain_db < _NOTHING_DB] = np.nan
    return CoverageMap(info["radio"], corner_m, info["cell_m"], info["devices"], gain_db)


def show_coverage(scene: bpy.types.Scene, found: CoverageMap, number: int) -> bpy.types.Object:
    """Adds a map as a surface in place of the one before.

    Its points carry `path_gain_db`; cells that no ray reaches are holes.

    Args:
        scene: Where to.
        found: The map.
        number: The transmitter; -1 for the loudest.

    Raises:
        AddonError: There is no such transmitter, or it is heard nowhere.
    """
    name, gain_db = found.of(number)
    if not np.isfinite(gain_db).any():
        raise AddonError(f"{name} is heard nowhere on this plane")
    clear_coverage(scene)
    mesh = _mesh(gain_db, found.cell_m)
    low, high = found_range([gain_db])
    mesh[SCALE] = {"mode": "COVERAGE", "low": low, "high": high, "attribute": ""}
    item = bpy.data.objects.new(f"Coverage of {found.radio}: {name}", mesh)
    item[OF] = name
    item.rfgs.object_class = "IGNORE"
    # Corners are metres; the object's scale carries them into the scene's units.
    unit = unit_scale(scene)
    item.location, item.scale = (found.corner_m / unit).tolist(), (1 / unit,) * 3
    own_collection(scene, COLLECTION).objects.link(item)
    return item


def _mesh(gain_db: np.ndarray, cell_m: float) -> bpy.types.Mesh:
    """A grid through the middles of cells, without quads that touch an unknown one."""
    rows, columns = gain_db.shape
    y, x = np.mgrid[:rows, :columns]
    places = np.stack([(x + 0.5) * cell_m, (y + 0.5) * cell_m, np.zeros_like(x)], axis=-1)
    number = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack(
        [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    values = gain_db.ravel()
    quads = quads[np.isfinite(values[quads]).all(axis=1)]
    mesh = bpy.data.meshes.new("Coverage")
    mesh.from_pydata(places.reshape(-1, 3).tolist(), [], quads.tolist())
    low, high = found_range([values])
    rgba = np.pad(ramp(values, low, high), ((0, 0), (0, 1)), constant_values=1.0)
    attributes.put(mesh, "path_gain_db", "FLOAT", values.astype(np.float32))
    attributes.put(mesh, COLOR_ATTRIBUTE, "FLOAT_COLOR", rgba.astype(np.float32))
    mesh.attributes.active_color_name = COLOR_ATTRIBUTE
    mesh.materials.append(material("GEOMETRY", COLOR_ATTRIBUTE))
    return mesh


def coverages(scene: bpy.types.Scene | None = None) -> list[bpy.types.Object]:
    """Surfaces that are shown, of one scene or of all."""
    homes = collections_of(COLLECTION) if scene is None else [found_collection(scene, COLLECTION)]
    return [item for home in homes if home is not None for item in home.objects if OF in item]


def clear_coverage(scene: bpy.types.Scene | None = None) -> int:
    """Removes every map, of one scene or of all; returns how many there were."""
    found = coverages(scene)
    for item in found:
        mesh = item.data
        bpy.data.objects.remove(item)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
    drop_empty(COLLECTION)
    return len(found)
