# SPDX-License-Identifier: GPL-3.0-or-later
"""NumPy's `.npz` files from anywhere: nothing is unpickled or allocated before it is checked."""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from .errors import AddonError
from .files import refuse_pipe

#: What zipfile, zlib and NumPy say of damaged files.
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, tokenize.TokenError, struct.error, OSError, EOFError,
    ValueError, KeyError, TypeError, SyntaxError, NotImplementedError, RuntimeError,
)  # fmt: skip

#: Says whether shape and type of an array are those that it may have; raises `AddonError` if not.
Check = Callable[[tuple[int, ...], np.dtype], None]


class ArrayFile:
    """An open `.npz`."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self._path, self._archive = path, archive

    def __contains__(self, name: str) -> bool:
        return f"{name}.npy" in self._archive.namelist()

    def read(self, name: str, check: Check) -> np.ndarray:
        """One array.

        Raises:
            AddonError: It is missing, is not what `check` allows, or is cut short.
        """
        if name not in self:
            raise AddonError(f"{self._path}: holds no {name}")
        with self._archive.open(f"{name}.npy") as stream:
            version = npy.read_magic(stream)
            header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, fortran, dtype = header(stream)
            if dtype.hasobject:
                raise AddonError(f"{self._path}: {name} holds {dtype}, which it cannot be")
            check(shape, dtype)
            size = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
            data = stream.read(size)
        if len(data) != size:
            raise AddonError(f"{self._path}: {name} is cut short, {len(data)} of {size} bytes")
        return np.frombuffer(data, dtype).reshape(shape, order="F" if fortran else "C")


@contextmanager
def array_file(path: Path) -> Iterator[ArrayFile]:
    """Opens a file of arrays.

    Raises:
        AddonError: It is damaged; also for what goes wrong while the block reads.
    """
    refuse_pipe(path)
    try:
        with zipfile.ZipFile(path) as archive:
            yield ArrayFile(path, archive)
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:80]
        raise AddonError(f"{path}: damaged array file ({reason})") from error
