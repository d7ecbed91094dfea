# SPDX-License-Identifier: Apache-2.0
"""Named arrays in .npz files, whole or absent, without pickle."""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.links import refuse_link
from rfgs_core.seals import BLANK, check_seal, sealed

#: Size of each axis: a number, or a name that stands for the same size throughout a file.
Shape = tuple[int | str, ...]

#: What zipfile, zlib and NumPy say of damaged files.
_DAMAGE = (
    *(OSError, ValueError, EOFError, MemoryError, NotImplementedError, RuntimeError, KeyError),
    *(TypeError, IndexError, ArithmeticError, AttributeError, SyntaxError),
    *(zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError),
)
#: Arrays of one file take no more than this, or so many times what the file takes [bytes].
_MOST_BYTES, _MOST_PACKED = 2**28, 32
_SINGLE = b"\x93NUMPY"
#: How an archive without comment ends, and one whose comment is a seal.
_NO_COMMENT, _SEAL = struct.pack("<H", 0), struct.pack("<H", len(BLANK)) + BLANK.encode()


def save_arrays(path: Path, arrays: Mapping[str, np.ndarray], *, packed: bool = False) -> None:
    """Writes arrays in one step, sealed; equal arrays give equal bytes. `packed` takes longer."""
    # In memory first: an archive that a full disk cuts short complains once more when it is freed.
    stream = io.BytesIO()
    (np.savez_compressed if packed else np.savez)(stream, **arrays)  # type: ignore[arg-type]
    write_bytes(path, sealed(stream.getvalue().removesuffix(_NO_COMMENT) + _SEAL))


def load_arrays(
    path: Path,
    remedy: str,
    shapes: Mapping[str, Shape | None] | None = None,
    unknown: Collection[str] = (),
    *,
    types: Mapping[str, str] | None = None,
    others: bool = False,
    seal: bool = True,
    optional: Mapping[str, Shape] | None = None,
) -> dict[str, np.ndarray]:
    """Reads the arrays of a file.

    Args:
        path: The file.
        remedy: What to do about a missing or damaged file, for the message.
        shapes: Arrays that must be there. Those with a shape must have it and hold finite
            numbers; None leaves both open. Without `shapes` every array is read.
        unknown: Arrays in which a whole row may be NaN, for what is not known.
        types: NumPy's names of the types that arrays may have, with spaces between.
        others: Also read arrays that `shapes` does not name.
        seal: Whether `save_arrays` wrote it; other files have their digests elsewhere, or none.
        optional: Shapes of arrays that may be missing.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: The file is damaged, or lacks an array, or one is not as it should be.

    Example:
        `load_arrays(path, "train again", {"means": ("M", 3), "power": ("M",), "names": None})`
    """
    refuse_link(path)
    try:
        with path.open("rb") as stream:
            if stream.read(len(_SINGLE)) == _SINGLE:
                raise RfgsFormatError(
                    f"{path}: expected named arrays, found a single one; {remedy}"
                )
            wanted = None if others or shapes is None else {**shapes, **(optional or {})}
            if seal:
                stream.seek(0)
                check_seal(path, stream.read(), remedy)
            arrays = _read(stream, wanted)
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file; {remedy}") from error
    except RfgsFormatError:
        raise
    except _DAMAGE as error:
        raise RfgsFormatError(f"{path}: damaged ({error}); {remedy}") from error
    known = {name: _without_unknown(arrays[name]) for name in unknown if name in arrays}
    there = {name: shape for name, shape in (optional or {}).items() if name in arrays}
    wanted = {**(shapes or {}), **there}
    problem = _misfit({**arrays, **known}, wanted) or _mistyped(arrays, types or {})
    if problem:
        raise RfgsFormatError(f"{path}: {problem}; {remedy}")
    return arrays


def load_array(path: Path, remedy: str, axes: int, most_bytes: int = _MOST_BYTES) -> np.ndarray:
    """Reads the one array of a .npy file; nothing is unpickled.

    Args:
        path: The file.
        remedy: What to do about a missing or damaged file, for the message.
        axes: How many axes it has.
        most_bytes: Larger arrays are refused before they are read [bytes].

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, holds objects that would have to be unpickled, or something
            else than numbers along so many axes.
    """
    refuse_link(path)
    try:
        with path.open("rb") as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            shape, dtype = _header(stream)
            length = math.prod(shape) * dtype.itemsize
            if dtype.kind not in "biufc" or len(shape) != axes:
                what = "objects, which are pickled" if dtype.hasobject else f"{dtype} {shape}"
                raise ValueError(f"expected numbers along {axes} axes, found {what}")
            if length > most_bytes or stream.tell() + length > size:
                raise ValueError(f"{length} bytes of {dtype} {shape} do not fit it")
            stream.seek(0)
            return np.lib.format.read_array(stream, allow_pickle=False)
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file; {remedy}") from error
    except _DAMAGE as error:
        raise RfgsFormatError(f"{path}: damaged or of another kind ({error}); {remedy}") from error


def _header(stream: BinaryIO) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type that the header of an array says.

    Raises:
        ValueError: It says what no array can have.
    """
    version = np.lib.format.read_magic(stream)
    header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    shape, _, dtype = header[version](stream)
    if any(length < 0 for length in shape):
        raise ValueError(f"expected lengths of axes, found {shape}")
    return shape, dtype


def _read(stream: BinaryIO, wanted: Collection[str] | None) -> dict[str, np.ndarray]:
    """Arrays of an archive by name; those of `wanted`, or all.

    Raises:
        ValueError: The archive says more of itself than its size can hold, or something else than
            its arrays do.
    """
    size = stream.seek(0, 2)
    with zipfile.ZipFile(stream) as archive:
        named = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
        if len(named) != len(archive.infolist()):
            raise ValueError("an array stands in it twice")
        chosen = {name: info for name, info in named.items() if wanted is None or name in wanted}
        total = sum(info.file_size for info in chosen.values())
        most = max(_MOST_BYTES, _MOST_PACKED * size)
        if total > most:
            raise ValueError(f"its arrays say that they take {total} bytes, expected up to {most}")
        return {name: _member(archive, info) for name, info in chosen.items()}


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """One array, once its header has been found to agree with its size."""
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{info.filename}: packed in another way than NumPy does")
    with archive.open(info) as member:
        shape, dtype = _header(cast(BinaryIO, member))
        if dtype.hasobject:
            raise ValueError(f"{info.filename}: expected numbers or text, found {dtype} {shape}")
        if member.tell() + math.prod(shape) * dtype.itemsize != info.file_size:
            raise ValueError(f"{info.filename}: {dtype} {shape} does not fit its size")
    with archive.open(info) as member:
        return np.lib.format.read_array(member, allow_pickle=False)


def _mistyped(arrays: Mapping[str, np.ndarray], types: Mapping[str, str]) -> str:
    """Which array has another type than it should, in words; empty if none has."""
    for name, kinds in types.items():
        if name not in arrays:
            continue
        found, expected = arrays[name].dtype, [np.dtype(kind) for kind in kinds.split()]
        # Text has a type for every length; `U` stands for them all.
        if found not in expected and (found.kind, kinds) != ("U", "U"):
            return f"{name}: expected {' or '.join(map(str, expected))}, got {found}"
    return ""


def _without_unknown(values: np.ndarray) -> np.ndarray:
    """Values with zeros in the rows that are all NaN."""
    if values.dtype.kind != "f" or values.ndim < 1:
        return values
    unknown = np.isnan(values).all(axis=tuple(range(1, values.ndim)))
    return np.where(unknown.reshape(-1, *[1] * (values.ndim - 1)), values.dtype.type(0), values)


def _misfit(arrays: Mapping[str, np.ndarray], shapes: Mapping[str, Shape | None]) -> str:
    """What is wrong with the arrays, in words; empty if nothing is."""
    missing = [name for name in shapes if name not in arrays]
    if missing:
        return f"expected arrays {', '.join(shapes)}; missing {', '.join(missing)}"
    sizes: dict[str, int] = {}
    for name, shape in shapes.items():
        if shape is None:
            continue
        found = arrays[name]
        if len(found.shape) == len(shape):
            named = zip(shape, found.shape, strict=True)
            sizes = {axis: size for axis, size in named if isinstance(axis, str)} | sizes
        expected = tuple(sizes.get(axis, axis) if isinstance(axis, str) else axis for axis in shape)
        if found.shape != expected:
            return f"{name} has shape {found.shape}, expected {expected}"
        if found.dtype.kind not in "biufc" or not np.isfinite(found).all():
            return f"{name} holds something else than finite numbers"
    return ""
