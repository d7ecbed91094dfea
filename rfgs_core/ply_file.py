# SPDX-License-Identifier: Apache-2.0
"""PLY files through plyfile: what a header says is held against the file before it is believed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyListProperty, PlyParseError

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.links import refuse_link
from rfgs_core.seals import check_seal

#: What plyfile and NumPy say of damaged files.
_DAMAGE = (
    *(PlyParseError, ValueError, TypeError, IndexError, EOFError, MemoryError, OverflowError),
    *(AttributeError, OSError, RuntimeError, StopIteration),
)


def read_elements(
    path: Path,
    what: str,
    lists: Mapping[str, Mapping[str, int]] | None = None,
    seal: str | None = None,
) -> PlyData:
    """Reads a PLY file.

    Args:
        path: The file.
        what: What is expected of it, for messages.
        lists: Lengths of lists by element and property, where all are equally long.
        seal: What to do about a file that has changed since it was sealed; None looks for no seal.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, or says that it holds more than fits into it.
    """
    with _reading(path, what):
        header, room = _header(path), path.stat().st_size
        for element in header.elements:
            row = 2 * len(element.properties) if header.text else _least_bytes(element.properties)
            if element.count * max(row, 1) > room:
                raise ValueError(f"{element.count} rows of {element.name!r} do not fit into it")
        if seal is not None:
            check_seal(path, path.read_bytes(), seal)
        return PlyData.read(str(path), known_list_len=dict(lists or {}))


def count_rows(path: Path, name: str, what: str) -> int:
    """How many rows the header of a file gives an element.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, or has no such element.
    """
    with _reading(path, what):
        return _header(path)[name].count


@contextmanager
def _reading(path: Path, what: str) -> Iterator[None]:
    refuse_link(path)
    try:
        yield
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file; expected {what}") from error
    except KeyError as error:
        raise RfgsFormatError(f"{path}: expected {what}, with an element {error}") from error
    except _DAMAGE as error:
        raise RfgsFormatError(f"{path}: expected {what}, not a whole PLY file ({error})") from error


def _header(path: Path) -> PlyData:
    with path.open("rb") as stream:
        return PlyData._parse_header(stream)


def _least_bytes(properties: tuple) -> int:
    """What a row takes at least: its numbers, and the lengths of its lists."""
    kinds = (
        each.list_dtype("<")[0] if isinstance(each, PlyListProperty) else each.dtype("<")
        for each in properties
    )
    return sum(np.dtype(kind).itemsize for kind in kinds)
