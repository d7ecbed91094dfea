# SPDX-License-Identifier: Apache-2.0
"""Every reader of captures, and which of them a file is for."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Protocol

from rfgs_core.capture.file_bytes import read_head
from rfgs_core.capture.model import Reading
from rfgs_core.errors import RfgsError, RfgsFormatError


class Reader(Protocol):
    """What every module of a format offers."""

    NAME: str
    """Name on the command line."""
    TITLE: str
    """Radio and tool, for people."""
    SUFFIXES: tuple[str, ...]
    """Endings of file names; a file is told by what it holds first."""

    def looks_like(self, head: bytes, path: Path) -> bool:
        """Whether a file that begins like this is of the format."""
        ...

    def read(self, path: Path) -> Reading:
        """Reads a whole file.

        Raises:
            RfgsError: The file cannot be read.
            RfgsFormatError: It is empty, too large, or holds no record.
        """
        ...


#: Modules of the readers, those that are told by their first bytes first.
READERS = (
    *("acconeer", "matlab", "nexmon", "picoscenes", "esp32", "dw1000"),
    *("feitcsi", "intel5300", "ti_adc", "nerf2"),
)


def reader(name: str) -> Reader:
    """A reader by its name.

    Raises:
        RfgsError: There is none of that name; the message lists those there are.
    """
    if name not in READERS:
        raise RfgsError(f"unknown format {name!r}; expected one of {', '.join(READERS)}")
    module: Reader = importlib.import_module(f"rfgs_core.capture.{name}")  # type: ignore[assignment]
    return module


def detect(path: Path) -> Reader:
    """Tells the reader of a file: by its first bytes, else by its name's ending.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: No reader knows it.
    """
    head = read_head(path)
    readers = [reader(name) for name in READERS]
    for candidate in readers:
        if candidate.looks_like(head, path):
            return candidate
    named = [candidate for candidate in readers if path.suffix.lower() in candidate.SUFFIXES]
    if len(named) == 1 and not path.is_dir():
        return named[0]
    if not head and not path.is_dir():
        raise RfgsFormatError(f"{path}: expected a capture, found an empty file")
    raise RfgsFormatError(f"{path}: no reader knows what it begins with; there are {_known()}")


def _known() -> str:
    """Every reader by name and radio, for messages."""
    return "; ".join(f"{one.NAME}: {one.TITLE}" for one in map(reader, READERS))


def read_capture(path: Path | str, form: str | None = None) -> Reading:
    """Reads a capture of any radio.

    Args:
        path: A file, or a folder of NeRF2's layout.
        form: Name of its reader; None tells it by what the file holds.

    Returns:
        A capture for each packet format in the file, and warnings.

    Raises:
        RfgsError: The file cannot be read, or there is no such reader.
        RfgsFormatError: No reader knows it, or it holds nothing that can be read.

    Example:
        `read_capture("walk.dat").largest.values` is (time, device, rx, tx, subcarrier).
    """
    path = Path(path)
    if form is not None:
        return reader(form).read(path)
    found = detect(path)
    try:
        return found.read(path)
    except RfgsFormatError as error:
        if found.looks_like(read_head(path), path):
            raise
        # An ending such as .txt is anybody's.
        raise RfgsFormatError(
            f"{error}; only the ending of its name told {found.NAME}, there are {_known()}"
        ) from error
