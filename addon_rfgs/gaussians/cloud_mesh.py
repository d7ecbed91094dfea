# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussians as the points of a mesh, and back as the properties of a PLY.

Each property of the PLY is kept bit for bit in an attribute `ply_<name>`, so that what is
deleted or moved in edit mode can be written back without loss; positions are the points' own.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..errors import AddonError
from . import attributes
from .coloring import FEATURE_NAME
from .ply import Columns
from .splats import POSITION, Cloud

#: Custom property of the mesh: name and type of each property of the PLY, in file order.
FIELDS = "rfgs_ply"
#: Custom property of the mesh: the frame it belongs to; absent if it is there all the time.
FRAME = "rfgs_frame"
_PREFIX = "ply_"


def make_mesh(frame: int | None, cloud: Cloud, radio: dict[str, np.ndarray]) -> bpy.types.Mesh:
    """A mesh of loose points, one per Gaussian, not yet coloured.

    Args:
        frame: The frame it belongs to.
        cloud: The Gaussians.
        radio: Arrays of `read_features`.
    """
    mesh, count = bpy.data.meshes.new("Gaussians"), len(cloud)
    mesh.vertices.add(count)
    mesh.vertices.foreach_set("co", np.ascontiguousarray(cloud.means).ravel())
    for key, kind, values in (
        ("opacity", "FLOAT", cloud.opacities),
        ("scale", "FLOAT_VECTOR", cloud.scales),
        ("rotation", "QUATERNION", cloud.quats),
        ("radius", "FLOAT", cloud.scales.mean(axis=1)),
    ):
        attributes.put(mesh, key, kind, values)
    _put_radio(mesh, cloud, radio)
    for key, values in cloud.columns.items():
        if key not in POSITION or values.dtype != np.float32:
            _put_property(mesh, key, values)
    kinds = [f"{values.dtype.str[1:]} {key}" for key, values in cloud.columns.items()]
    mesh[FIELDS] = "\n".join(kinds)
    if frame is not None:
        mesh[FRAME] = frame
    mesh.update()
    return mesh


def _put_radio(mesh: bpy.types.Mesh, cloud: Cloud, radio: dict[str, np.ndarray]) -> None:
    """Power, phase, track, features: what is known; power is NaN and tracks are rows if not."""
    count = len(cloud)
    power = radio.get("rf_power_db", cloud.columns.get("rf_power_db", np.full(count, np.nan)))
    attributes.put(mesh, "rf_power_db", "FLOAT", np.where(np.isfinite(power), power, np.nan))
    tracks = radio.get("track_id", np.arange(count))
    attributes.put(mesh, "gid", "INT", np.clip(tracks, -(2**31), 2**31 - 1))
    if "body" in radio:
        attributes.put(mesh, "body", "INT", np.clip(radio["body"], -(2**31), 2**31 - 1))
    error_m = radio.get("error_m", cloud.columns.get("error_m"))
    if error_m is not None:
        attributes.put(mesh, "error_m", "FLOAT", error_m)
    if "gamma" in radio and radio["gamma"].shape[1]:
        knots = radio["gamma"]
        middle = knots[:, (knots.shape[1] - 1) // 2 : knots.shape[1] // 2 + 1].mean(axis=1)
        attributes.put(mesh, "rf_gamma", "FLOAT2", np.stack([middle.real, middle.imag], axis=1))
        attributes.put(mesh, "rf_phase", "FLOAT", np.angle(middle))
    for index, column in enumerate(radio.get("features", np.zeros((count, 0))).T):
        attributes.put(mesh, FEATURE_NAME.format(index), "FLOAT", column)


def _put_property(mesh: bpy.types.Mesh, name: str, values: np.ndarray) -> None:
    """Keeps the bits of any PLY type in one of Blender's."""
    kind = values.dtype.str[1:]
    if kind == "f4":
        attributes.put(mesh, _PREFIX + name, "FLOAT", values)
    elif kind == "f8":
        attributes.put(mesh, _PREFIX + name, "INT32_2D", values.view(np.int32).reshape(-1, 2))
    else:
        whole = values.view(np.int32) if kind == "u4" else values
        attributes.put(mesh, _PREFIX + name, "INT", whole)


def ply_columns(mesh: bpy.types.Mesh) -> Columns:
    """The properties of the points that are left, as they were read; positions as they are now.

    Raises:
        AddonError: The mesh was not imported here, or lost attributes since.
    """
    if not isinstance(mesh.get(FIELDS), str):
        raise AddonError(f"{mesh.name}: not imported by RF-GS, so it has no properties of a PLY")
    columns: Columns = {}
    places = attributes.positions(mesh)
    for entry in mesh[FIELDS].split("\n"):
        kind, _, name = entry.partition(" ")
        if name in POSITION and kind == "f4":
            columns[name] = places[:, POSITION.index(name)]
            continue
        stored = attributes.get(mesh, _PREFIX + name)
        if stored is None:
            raise AddonError(f"{mesh.name}: the attribute {_PREFIX}{name} is gone; import it again")
        columns[name] = _typed(stored, kind)
        if name in POSITION:  # wider than Blender's: kept where the point was not moved
            now = places[:, POSITION.index(name)]
            moved = columns[name].astype(np.float32) != now
            columns[name] = np.where(moved, now, columns[name]).astype(kind)
    return columns


def _typed(stored: np.ndarray, kind: str) -> np.ndarray:
    if kind == "f8":
        return np.ascontiguousarray(stored).view(np.float64)[:, 0]
    return stored.view(np.uint32) if kind == "u4" else stored.astype(kind)
