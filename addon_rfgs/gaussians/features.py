# SPDX-License-Identifier: GPL-3.0-or-later
"""The radio side of Gaussians, in an array file beside their PLY."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..array_file import array_file
from ..errors import AddonError
from ..seals import check_seal

#: Array → kinds of numbers it may hold, and whether it has a second axis.
_ARRAYS = {
    "features": ("f", True),
    "gamma": ("c", True),
    "rf_power_db": ("f", False),
    "track_id": ("iu", False),
    "body": ("iu", False),
    "error_m": ("f", False),
    "bone": ("iu", False),
    "sigma_m": ("f", False),
}
#: Most numbers per Gaussian of one array.
_MAX_WIDTH = 256


def read_features(ply: Path, count: int) -> dict[str, np.ndarray]:
    """Arrays of `<name>.features.npz` beside a PLY, those that are there; rows as in the PLY.

    `features` is [M, F], `gamma` complex [M, K] (one value, or one per knot of the band),
    the others [M]. Nothing is unpickled, and nothing is allocated before its size is checked.

    Args:
        ply: The PLY.
        count: Its Gaussians.

    Raises:
        AddonError: The file is damaged or does not belong to the PLY, or one of them has changed
            since it was written.
    """
    path = ply.with_name(ply.stem + ".features.npz")
    if not path.is_file():
        return {}
    for file in (ply, path):
        check_seal(file, "train this run again")
    with array_file(path) as arrays:
        return {
            name: arrays.read(name, lambda *found, name=name: _check(path, name, count, *found))
            for name in _ARRAYS
            if name in arrays
        }


def _check(path: Path, name: str, count: int, shape: tuple[int, ...], dtype: np.dtype) -> None:
    kinds, wide = _ARRAYS[name]
    if len(shape) != 1 + wide or shape[0] != count or max(shape[1:], default=1) > _MAX_WIDTH:
        raise AddonError(f"{path}: {name} has shape {list(shape)}; the PLY holds {count} Gaussians")
    if dtype.kind not in kinds:
        raise AddonError(f"{path}: {name} holds {dtype}, which it cannot be")
