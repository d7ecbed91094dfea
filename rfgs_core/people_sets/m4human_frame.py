# SPDX-License-Identifier: Apache-2.0
"""One frame of M4Human, in whichever form it was stored.

The tensor has the axes across (−3 to 3 m, 121 cells), ahead (0.5 to 6 m, 111) and up (0 to 3 m,
31), first and last cells at both ends (`pc3d_to_tensor_idx` of the authors' loader), and holds
power (`radar_grid_to_pointcloud` there). It was cut off below a threshold. Points are rows of
across, ahead, up [m] and an intensity whose unit nobody tells; they are read where there is no
tensor.

The loader takes row 0 of the joints as the pelvis and its model's joints from SMPL-X, so the rows
are taken as those of SMPL-X. Heights are 0 to 3 m, so they count from the floor; how high the radar
hangs nobody says.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsFormatError
from rfgs_core.people_sets.mmbody import SMPLX
from rfgs_core.people_sets.model import joints_of, strongest_cells

#: Height of the radar above the floor [m]; assumed, see the module.
RADAR_M = 1.5
#: Cells of a tensor; where the first ones are, and how far apart they are [m].
CELLS = (121, 111, 31)
_START_M = np.array([-3.0, 0.5, 0.0])
_STEP_M = np.array([6.0 / 120, 5.5 / 110, 3.0 / 30])
_MOST_POINTS = 1_000_000
ASSUMPTIONS = (
    "joints are those of SMPL-X, row by row",
    f"heights count from the floor, the radar hangs {RADAR_M:g} m above it",
    "tensors hold power",
)

Heard = tuple[Float64[np.ndarray, "point 3"], Float64[np.ndarray, "point"]]
"""Places seen from the radar [m], and amplitudes."""


def heard_tensor(path: Path, cube: np.ndarray) -> Heard:
    """The strongest cells of a whole tensor.

    Args:
        path: Where it stands, for the message.
        cube: As `CELLS`.

    Raises:
        RfgsFormatError: It is none.
    """
    if cube.shape != CELLS or cube.dtype.kind not in "fiu":
        raise RfgsFormatError(f"{path}: expected a tensor of {CELLS}, found {cube.shape}")
    flat = np.where(np.isfinite(cube), cube, 0.0).reshape(-1).astype(np.float64)
    best = strongest_cells(flat)
    cells = np.stack(np.unravel_index(best, CELLS), axis=-1)
    return _START_M + cells * _STEP_M - [0.0, 0.0, RADAR_M], np.sqrt(flat[best])


def heard_cells(path: Path, rows: np.ndarray) -> Heard:
    """The same of the cells that are not zero: rows of three numbers of a cell and its power.

    Raises:
        RfgsFormatError: They are none, or outside the tensor.
    """
    if rows.ndim != 2 or rows.shape[1] != 4 or len(rows) > np.prod(CELLS):
        raise RfgsFormatError(f"{path}: expected rows (N, 4) of cells, found {rows.shape}")
    where = rows[:, :3]
    if not (np.isfinite(where).all() and (where >= 0).all() and (where < CELLS).all()):
        raise RfgsFormatError(f"{path}: expected cells of a tensor of {CELLS}, found others")
    cube = np.zeros(CELLS)
    cube[tuple(where.astype(np.int64).T)] = rows[:, 3]
    return heard_tensor(path, cube)


def heard_points(path: Path, rows: np.ndarray) -> Heard:
    """Points of a detector, all as strong.

    Raises:
        RfgsFormatError: They are no rows of three numbers or more, or too many.
    """
    if rows.ndim != 2 or rows.shape[1] < 3 or rows.dtype.kind not in "fiu":
        raise RfgsFormatError(f"{path}: expected points (N, 4), found {rows.shape}")
    if len(rows) > _MOST_POINTS:
        raise RfgsFormatError(f"{path}: {len(rows)} points, at most {_MOST_POINTS} are read")
    places = rows[:, :3].astype(np.float64)
    # Rows of zeros fill up the loader's own copies.
    places = places[np.isfinite(places).all(axis=1) & places.any(axis=1)] - [0.0, 0.0, RADAR_M]
    return places, np.ones(len(places))


def joints_seen(
    path: Path,
    joints: Sequence[Sequence[float]] | Float64[np.ndarray, "joint 3"],
    turn: Float64[np.ndarray, "3 3"],
    shift: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, "17 3"]:
    """Joints seen from the radar.

    Args:
        path: Where they stand, for the message.
        joints: Rows of SMPL-X in the axes of the motion capture [m].
        turn: To the radar's axes, see `to_radar`.
        shift: To the floor below the radar [m].

    Raises:
        RfgsFormatError: There are fewer rows, or they do not have three numbers.
    """
    if len(joints) <= max(SMPLX.values()) or any(len(row) != 3 for row in joints):
        raise RfgsFormatError(f"{path}: expected 22 joints of 3 numbers or more")
    there = np.array(joints, np.float64) @ turn.T + shift - [0.0, 0.0, RADAR_M]
    return joints_of(there, SMPLX)


def to_radar(
    path: Path,
    vicon: Float64[np.ndarray, "3 3"],
    vicon_mm: Float64[np.ndarray, "3"],
    radar: Float64[np.ndarray, "3 3"],
    radar_m: Float64[np.ndarray, "3"],
) -> tuple[Float64[np.ndarray, "3 3"], Float64[np.ndarray, "3"]]:
    """From the motion capture's axes to the radar's: x ↦ turn x + shift.

    Args:
        path: Where they stand, for the message.
        vicon: From the motion capture to the camera.
        vicon_mm: Its shift [mm].
        radar: From the radar to the camera.
        radar_m: Its shift [m].

    Raises:
        RfgsFormatError: The radar is not turned but squeezed.
    """
    if abs(abs(float(np.linalg.det(radar))) - 1.0) > 0.1:
        raise RfgsFormatError(f"{path}: expected a turn from the radar to the camera")
    back = np.linalg.inv(radar)
    return back @ vicon, back @ (vicon_mm / 1000.0 - radar_m)
