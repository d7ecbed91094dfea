# SPDX-License-Identifier: GPL-3.0-or-later
"""The header of a PLY file: what its vertices hold and where they begin."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..errors import AddonError
from ..files import refuse_pipe

#: Names of scalar types in PLY files, old and new, to NumPy's (without byte order).
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip

#: Format → byte order for NumPy; None is text.
FORMATS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": None}

#: A header longer than this is no header [bytes].
MAX_HEADER = 1 << 20
#: Blender slows down with the number of attributes; 3DGS files have 62.
MAX_PROPERTIES = 512
#: Blender cuts attribute names at 63 bytes, and a prefix is added to these.
_NAME = re.compile(r"[!-~]{1,48}")


@dataclass
class Element:
    """One block of a PLY file."""

    name: str
    count: int
    fields: list[tuple[str, str]]
    """Name and NumPy type of each scalar property, in file order."""
    has_lists: bool = False


@dataclass(frozen=True)
class Header:
    """What stands before the data."""

    order: str | None
    """Byte order for NumPy, None for text."""
    size: int
    """Bytes before the data."""
    before: list[Element]
    """Elements that precede the vertices."""
    vertex: Element
    last: bool
    """Whether the vertices are the last element."""


def read_header(path: Path) -> Header:
    """Reads the header alone, however large the file.

    Raises:
        AddonError: The file is missing, is no PLY, or its vertices cannot be read.
    """
    try:
        refuse_pipe(path)
        with path.open("rb") as stream:
            start = stream.read(MAX_HEADER)
    except FileNotFoundError as error:
        raise AddonError(f"{path}: no such file") from error
    except OSError as error:
        raise AddonError(f"{path}: cannot be read ({error.strerror})") from error
    if not re.match(rb"ply\r?\n", start):
        raise AddonError(f"{path}: expected a PLY file, which starts with the line 'ply'")
    end = re.search(rb"\nend_header\r?\n", start)
    if end is None:
        raise AddonError(
            f"{path}: the PLY header does not end within {MAX_HEADER >> 20} MiB (no 'end_header')"
        )
    lines = start[: end.start()].decode("ascii", "replace").splitlines()[1:]
    order, elements = _parse(path, lines)
    names = [element.name for element in elements]
    if names.count("vertex") != 1:
        raise AddonError(f"{path}: expected one element 'vertex', found {names.count('vertex')}")
    at = names.index("vertex")
    _check_vertex(path, elements[at])
    if any(element.has_lists for element in elements[:at]):
        raise AddonError(f"{path}: lists stand before the vertices; write the vertices first")
    return Header(order, end.end(), elements[:at], elements[at], at == len(names) - 1)


def _parse(path: Path, lines: list[str]) -> tuple[str | None, list[Element]]:
    formats: list[str] = []
    elements: list[Element] = []
    for line in lines:
        words = line.split()
        if not words or words[0] in {"comment", "obj_info"}:
            continue
        if words[0] == "format" and len(words) == 3 and words[1] in FORMATS:
            formats.append(words[1])
        elif words[0] == "element" and len(words) == 3 and re.fullmatch(r"[0-9]{1,12}", words[2]):
            elements.append(Element(words[1], int(words[2]), []))
        elif words[0] == "property" and len(words) == 5 and words[1] == "list" and elements:
            elements[-1].has_lists = True
        elif words[0] == "property" and len(words) == 3 and words[1] in TYPES and elements:
            elements[-1].fields.append((words[2], TYPES[words[1]]))
        else:
            raise AddonError(f"{path}: header line {line.strip()[:60]!r} is not understood")
    if len(formats) != 1:
        raise AddonError(f"{path}: expected one 'format' line in the header, found {len(formats)}")
    return FORMATS[formats[0]], elements


def _check_vertex(path: Path, vertex: Element) -> None:
    names = [name for name, _ in vertex.fields]
    if vertex.has_lists:
        raise AddonError(f"{path}: vertices hold a list; expected numbers only")
    if not names:
        raise AddonError(f"{path}: the header describes no properties of vertices")
    if len(names) > MAX_PROPERTIES:
        raise AddonError(
            f"{path}: vertices have {len(names)} properties; expected at most {MAX_PROPERTIES}"
        )
    for name in names:
        if names.count(name) > 1:
            raise AddonError(f"{path}: property {name[:48]!r} is there twice")
        if not _NAME.fullmatch(name):
            raise AddonError(
                f"{path}: property name {name[:48]!r} is not 1 to 48 printable ASCII characters"
            )
