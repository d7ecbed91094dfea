# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY files as columns: text and binary of both byte orders in, binary little-endian out."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..errors import AddonError
from ..files import replacing
from .ply_header import TYPES, Element, Header, read_header

#: Vertices by property, in file order; the type is the file's own, in this machine's byte order.
Columns = dict[str, np.ndarray]

#: Rows that are turned into columns at a time: their pages stay in the cache.
_BLOCK = 1 << 14
#: NumPy type → the name written into headers.
_WRITTEN = {kind: name for name, kind in reversed(TYPES.items())}


def read_columns(path: Path) -> Columns:
    """Reads every scalar property of the vertices; other elements are left out.

    Nothing is allocated before the file is known to be long enough for it.

    Raises:
        AddonError: The file is missing, no PLY, cut short, longer than its header says, or
            holds what vertices of numbers cannot.
    """
    header = read_header(path)
    length = path.stat().st_size - header.size
    if header.order is None:
        return _read_text(path, header, length)
    return _read_binary(path, header, length)


def write_columns(path: Path, columns: Columns) -> None:
    """Writes one element `vertex` with these properties, whole or not at all.

    Args:
        path: File to write.
        columns: One-dimensional arrays of one length and of types that PLY knows.
    """
    fields = [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()]
    count = len(next(iter(columns.values())))
    rows = np.zeros(count, np.dtype(fields))
    for name, values in columns.items():
        rows[name] = values
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    lines += [f"property {_WRITTEN[kind.str[1:]]} {name}" for name, kind in fields]
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.write(("\n".join([*lines, "end_header"]) + "\n").encode("ascii"))
        rows.tofile(stream)


def _read_binary(path: Path, header: Header, length: int) -> Columns:
    kinds = [np.dtype(kind).newbyteorder(header.order) for _, kind in header.vertex.fields]
    names, count = [name for name, _ in header.vertex.fields], header.vertex.count
    width = sum(kind.itemsize for kind in kinds)
    skipped = sum(element.count * _width(element) for element in header.before)
    spare = length - skipped - count * width
    if spare < 0:
        raise AddonError(
            f"{path}: truncated, {count} vertices need {skipped + count * width} bytes, "
            f"got {length}"
        )
    if header.last and spare >= width:
        raise AddonError(f"{path}: holds {spare} bytes more than its {count} vertices need")
    offset = header.size + skipped
    if len(set(kinds)) == 1:
        table = np.fromfile(path, kinds[0], count * len(names), offset=offset)
        return _split(names, table.reshape(count, len(names)))
    fields = list(zip(names, kinds, strict=True))
    rows = np.fromfile(path, np.dtype(fields), count, offset=offset)
    return {name: rows[name].astype(kind.newbyteorder("=")) for name, kind in fields}


def _split(names: list[str], table: np.ndarray) -> Columns:
    """Columns of a table of one type; block by block, ten times as fast as column by column."""
    columns = np.zeros(table.shape[::-1], table.dtype.newbyteorder("="))
    for start in range(0, len(table), _BLOCK):
        columns[:, start : start + _BLOCK] = table[start : start + _BLOCK].T
    return dict(zip(names, columns, strict=True))


def _width(element: Element) -> int:
    return sum(np.dtype(kind).itemsize for _, kind in element.fields)


def _read_text(path: Path, header: Header, length: int) -> Columns:
    skipped = sum(element.count * len(element.fields) for element in header.before)
    wanted = skipped + header.vertex.count * len(header.vertex.fields)
    if 2 * wanted - 1 > length:  # a digit and a space each
        raise AddonError(
            f"{path}: truncated, {header.vertex.count} vertices need {wanted} numbers, "
            f"got {length} characters"
        )
    with path.open("rb") as stream:
        stream.seek(header.size)
        body = stream.read()
    # The zero behind the last number is only reached if nothing before it is no number.
    numbers = _numbers(path, body + b"\n0", wanted + 1 if not header.last else -1)
    spare = len(numbers) - wanted - 1
    if spare < 0:
        raise AddonError(
            f"{path}: {header.vertex.count} vertices need {wanted} numbers; what stands after "
            f"the first {len(numbers)} is missing or no number"
        )
    if spare > 0:
        raise AddonError(f"{path}: holds {spare} numbers too many")
    names = [name for name, _ in header.vertex.fields]
    table = numbers[skipped:wanted].reshape(header.vertex.count, len(names))
    found = _split(names, table)
    return {name: _typed(path, name, found[name], kind) for name, kind in header.vertex.fields}


def _numbers(path: Path, body: bytes, count: int) -> np.ndarray:
    """The numbers of a text up to the first thing that is none, float64."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # said of what is no number
            return np.fromstring(body, np.float64, count, sep=" ")
    except ValueError as error:  # the same in newer NumPy
        word = re.sub(r"[^ -~]", "?", str(error))[:60]
        raise AddonError(f"{path}: the text holds something that is no number ({word})") from error


def _typed(path: Path, name: str, values: np.ndarray, kind: str) -> np.ndarray:
    """Numbers as the header's type; whole numbers must fit."""
    if kind == "f8":
        return values
    with np.errstate(over="ignore", invalid="ignore"):
        cast = values.astype(kind)
    if kind != "f4" and not np.array_equal(cast, values):
        raise AddonError(f"{path}: {name} holds numbers that are no {_WRITTEN[kind]}")
    return cast


def stacked(columns: Columns, names: Iterable[str]) -> np.ndarray:
    """Some columns side by side, float32 [M, len(names)]."""
    with np.errstate(over="ignore"):
        return np.stack([columns[name].astype(np.float32) for name in names], axis=-1)
