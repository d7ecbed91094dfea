# SPDX-License-Identifier: GPL-3.0-or-later
"""The radio side of Gaussians, in an array file beside their PLY."""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from ..errors import AddonError

#: Array → kinds of numbers it may hold, and whether it has a second axis.
_ARRAYS = {
    "features": ("f", True),
    "gamma": ("c", True),
    "rf_power_db": ("f", False),
    "track_id": ("iu", False),
    "body": ("iu", False),
    "error_m": ("f", False),
}
#: Most numbers per Gaussian of one array.
_MAX_WIDTH = 256
#: What zipfile, zlib and NumPy say of damaged files.
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, tokenize.TokenError, struct.error, OSError, EOFError,
    ValueError, KeyError, TypeError, SyntaxError, NotImplementedError, RuntimeError,
)  # fmt: skip


def read_features(ply: Path, count: int) -> dict[str, np.ndarray]:
    """Arrays of `<name>.features.npz` beside a PLY, those that are there; rows as in the PLY.

    `features` is [M, F], `gamma` complex [M, K] (one value, or one per knot of the band),
    the others [M]. Nothing is unpickled, and nothing is allocated before its size is checked.

    Args:
        ply: The PLY.
        count: Its Gaussians.

    Raises:
        AddonError: The file is damaged or does not belong to the PLY.
    """
    path = ply.with_name(ply.stem + ".features.npz")
    if not path.is_file():
        return {}
    try:
        with zipfile.ZipFile(path) as archive:
            names = [name for name in _ARRAYS if f"{name}.npy" in archive.namelist()]
            return {name: _read(path, archive, name, count) for name in names}
    except _DAMAGE as error:
        raise AddonError(f"{path}: damaged array file ({' '.join(str(error).split())[:80]})") from (
            error
        )


def _read(path: Path, archive: zipfile.ZipFile, name: str, count: int) -> np.ndarray:
    kinds, wide = _ARRAYS[name]
    with archive.open(f"{name}.npy") as stream:
        version = npy.read_magic(stream)
        header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran, dtype = header(stream)
        if len(shape) != 1 + wide or shape[0] != count or max(shape[1:], default=1) > _MAX_WIDTH:
            raise AddonError(
                f"{path}: {name} has shape {list(shape)}; the PLY holds {count} Gaussians"
            )
        if dtype.kind not in kinds or dtype.hasobject:
            raise AddonError(f"{path}: {name} holds {dtype}, which it cannot be")
        size = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        data = stream.read(size)
    if len(data) != size:
        raise AddonError(f"{path}: {name} is cut short, {len(data)} of {size} bytes")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if fortran else "C")
