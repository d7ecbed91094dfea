# SPDX-License-Identifier: GPL-3.0-or-later
"""Per-point attributes of meshes as NumPy arrays."""

from __future__ import annotations

import bpy
import numpy as np

from ..errors import AddonError

#: Kind of attribute → name of its value, NumPy type, numbers per point.
_KINDS = {
    "FLOAT": ("value", "f4", 1),
    "INT": ("value", "i4", 1),
    "INT32_2D": ("value", "i4", 2),
    "FLOAT2": ("vector", "f4", 2),
    "FLOAT_VECTOR": ("vector", "f4", 3),
    "FLOAT_COLOR": ("color", "f4", 4),
    "QUATERNION": ("value", "f4", 4),
}


def put(mesh: bpy.types.Mesh, name: str, kind: str, values: np.ndarray) -> None:
    """Writes an attribute of every point, made if it is not there yet.

    Raises:
        AddonError: The mesh is being edited, so its attributes are out of reach.
    """
    _need_object_mode(mesh)
    field, number, _ = _KINDS[kind]
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (kind, "POINT"):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set(field, np.ascontiguousarray(values, number).ravel())


def get(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    """Values of an attribute, [M] or [M, numbers per point]; None if there is none of points.

    Raises:
        AddonError: The mesh is being edited, so its attributes are out of reach.
    """
    _need_object_mode(mesh)
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.domain != "POINT" or attribute.data_type not in _KINDS:
        return None
    field, number, width = _KINDS[attribute.data_type]
    values = np.zeros(len(mesh.vertices) * width, number)
    attribute.data.foreach_get(field, values)
    return values if width == 1 else values.reshape(-1, width)


def positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """Places of the points in the object's own axes, float32 [M, 3]."""
    values = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def _need_object_mode(mesh: bpy.types.Mesh) -> None:
    if mesh.is_editmode:
        raise AddonError(f"{mesh.name} is in edit mode; leave it first")
