# SPDX-License-Identifier: GPL-3.0-or-later
"""Edited clouds back into a 3DGS PLY; what was not edited is written bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import mathutils
import numpy as np

from ..errors import AddonError
from ..scene.frames import unit_scale
from .cloud_mesh import ply_columns
from .ply import Columns, write_columns
from .splats import POSITION, ROTATION, SCALE

_NORMAL = ("nx", "ny", "nz")
#: Object transforms closer to none than this are none: matrices are single precision.
_NONE = 2e-6
#: A rotation may be so far from one before it counts as shear.
_SHEAR = 1e-4


def export_gaussians(scene: bpy.types.Scene, items: Sequence[bpy.types.Object], path: Path) -> int:
    """Writes clouds into one binary PLY, in metres and world axes; returns how many Gaussians.

    Points that were deleted are absent, points that were moved are where they are now, and the
    transform of the object is applied. All else is as in the PLY that was imported.

    Raises:
        AddonError: The clouds hold different properties, were not imported here, or their
            transform is none that Gaussians can follow; nothing is written then.
    """
    if path.suffix.lower() != ".ply":
        raise AddonError(f"{path}: expected a file name ending in .ply")
    if not items:
        raise AddonError("no cloud to write: select imported Gaussians, or go to their frame")
    bpy.context.view_layer.update()
    parts = []
    for item in items:
        if item.mode == "EDIT":
            item.update_from_editmode()
        columns = ply_columns(item.data)
        _check_same(item, columns, parts)
        parts.append(_placed(item, columns, unit_scale(scene)))
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    write_columns(path, joined)
    return len(joined["x"])


def _check_same(item: bpy.types.Object, columns: Columns, parts: list[Columns]) -> None:
    if parts:
        first = [(name, values.dtype) for name, values in parts[0].items()]
        if [(name, values.dtype) for name, values in columns.items()] != first:
            raise AddonError(
                f"{item.name}: holds other properties than the clouds before it; write it alone"
            )


def _placed(item: bpy.types.Object, columns: Columns, unit: float) -> Columns:
    """The Gaussians where the object's transform puts them."""
    matrix = np.array(item.matrix_world, dtype=np.float64)
    linear, shift = matrix[:3, :3] * unit, matrix[:3, 3] * unit
    turned = np.abs(linear - np.eye(3)).max() > _NONE
    if not turned and not shift.any():
        return columns
    linear = linear if turned else np.eye(3)
    placed = dict(columns)
    _replace(placed, POSITION, _stack(columns, POSITION) @ linear.T + shift)
    if turned:
        _turn(item, placed, linear)
    return placed


def _turn(item: bpy.types.Object, placed: Columns, linear: np.ndarray) -> None:
    """Turns and scales the shapes."""
    determinant = float(np.linalg.det(linear))
    size = np.cbrt(determinant) if determinant > 0 else 1.0
    rotation = linear / size
    if determinant <= 0 or np.abs(rotation @ rotation.T - np.eye(3)).max() > _SHEAR:
        raise AddonError(
            f"{item.name}: is mirrored, sheared or scaled unequally along its axes, which "
            "Gaussians cannot follow; apply an equal scale and a rotation alone"
        )
    if abs(size - 1) > _NONE:
        _replace(placed, SCALE, _stack(placed, SCALE) + np.log(size))
    if np.abs(rotation - np.eye(3)).max() <= _NONE:
        return
    if any(values.any() for name, values in placed.items() if name.startswith("f_rest_")):
        raise AddonError(
            f"{item.name}: is rotated, but its colours depend on direction (f_rest); clear its "
            "rotation and write it again"
        )
    turn = np.array(mathutils.Matrix(rotation.tolist()).to_quaternion())
    _replace(placed, ROTATION, _product(turn, _stack(placed, ROTATION)))
    if all(name in placed for name in _NORMAL):
        _replace(placed, _NORMAL, _stack(placed, _NORMAL) @ rotation.T)


def _product(first: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Quaternion products first ⊗ others [M, 4], w first."""
    w, axis = first[0], first[1:]
    real = w * others[:, 0] - others[:, 1:] @ axis
    imaginary = w * others[:, 1:] + others[:, :1] * axis + np.cross(axis, others[:, 1:])
    return np.concatenate([real[:, None], imaginary], axis=1)


def _stack(columns: Columns, names: Sequence[str]) -> np.ndarray:
    return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def _replace(columns: Columns, names: Sequence[str], values: np.ndarray) -> None:
    for index, name in enumerate(names):
        columns[name] = values[:, index].astype(columns[name].dtype)
