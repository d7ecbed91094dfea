# SPDX-License-Identifier: Apache-2.0
"""Files and folders that are either whole or absent: written beside their name, then renamed."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.links import kind_of, refuse_link, stands_at

#: Objects of Python take some thirty times the bytes that the file has.
LARGEST_JSON_BYTES = 2**25
#: Opens to read and does not wait, where the system knows of that.
_READ_AT_ONCE = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
#: Where a dataset and a run keep what was drawn or predicted of them; nothing reads it as theirs.
_BESIDE = {"a dataset": "log/preview", "a run": "predictions"}


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a temporary name beside `path`; renames it to `path` if the block succeeds.

    The temporary name keeps the suffix, so that writers which look at it still work.

    Raises:
        RfgsFormatError: `path` leads out of its dataset or run.
    """
    refuse_link(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".tmp-{uuid.uuid4().hex[:8]}-{path.name}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yields a temporary folder beside `path`; renames it to `path` if the block succeeds.

    Raises:
        OSError: `path` has appeared meanwhile and is no empty folder.
        RfgsFormatError: `path` leads out of its dataset or run.
    """
    refuse_link(path)
    temporary = path.with_name(f".tmp-{uuid.uuid4().hex[:8]}-{path.name}")
    temporary.mkdir(parents=True)
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def refuse_place(path: Path) -> None:
    """Refuses a place where nothing can be made, before any work is done for it.

    Permissions do not tell: they mean little to some users and file systems, so a folder is made
    there and removed again.

    Args:
        path: File or folder that shall be written.

    Raises:
        RfgsError: Nothing can be made there, or it leads out of its dataset or run.
    """
    refuse_link(path)
    try:
        near = next(place for place in (path, *path.absolute().parents) if place.exists())
        # A file that is there already is replaced, by one that is written beside it.
        folder = path.parent if near == path and not path.is_dir() else near
        with tempfile.TemporaryDirectory(prefix=".tmp-", dir=folder):
            return
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise
        raise RfgsError(
            f"{path}: nothing can be made there ({error.strerror}); choose another place"
        ) from error


def refuse_inside(path: Path, *, itself: bool = True) -> None:
    """Refuses a place whose files belong to a dataset, a run or a scene bundle.

    What is written there would replace files of theirs, or be taken for one: their own commands
    would then answer wrongly, and in silence. Free are the folders where our commands keep what
    they draw and predict.

    Args:
        path: File or folder that shall be written.
        itself: Whether it may not be such a folder either.

    Raises:
        RfgsError: It lies in such a folder, or is one.
    """
    real = Path(os.path.realpath(path))
    for folder in (real, *real.parents) if itself else real.parents:
        kind = kind_of(folder)
        free = _BESIDE.get(kind)
        if kind and not (free and real.is_relative_to(folder / free)):
            what = f"is {kind}" if folder == real else f"lies in {kind}, {folder}"
            raise RfgsError(f"{path} {what}, whose files are its own; choose another place")


def sweep(folder: Path, *patterns: str) -> None:
    """Removes what a killed program has left half-written below a folder; no link is followed."""
    for entry in [entry for pattern in patterns for entry in folder.rglob(pattern)]:
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink(missing_ok=True)


def write_bytes(path: Path, data: bytes) -> None:
    """Writes `data` to `path` in one step."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8 `text` to `path` in one step."""
    write_bytes(path, text.encode("utf-8"))


def write_json(path: Path, value: Any) -> None:
    """Writes `value` as indented JSON with sorted keys, so equal values give equal bytes."""
    write_text(path, json_text(value))


def json_text(value: Any) -> str:
    """Indented JSON with sorted keys, as all files of ours have it."""
    return json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n"


def json_bytes(path: Path, *, links_known: bool = False) -> bytes:
    """What is in a JSON file of at most `LARGEST_JSON_BYTES`, reached without forbidden links.

    Raises:
        FileNotFoundError: There is no such file.
        RfgsFormatError: It is larger, or lies where a link leads.
    """
    try:
        # Whoever opens a pipe like this does not wait for somebody who writes.
        place = os.open(path, _READ_AT_ONCE)
    except OSError:
        refuse_link(path)
        raise
    try:
        if not (links_known or stands_at(place, path)):
            refuse_link(path)
        if (size := os.fstat(place).st_size) > LARGEST_JSON_BYTES:
            raise RfgsFormatError(f"{path}: larger than any JSON file of ours; expected JSON")
        content = os.read(place, size)
        while len(content) < size and (more := os.read(place, size - len(content))):
            content += more
        return content
    finally:
        os.close(place)


def read_json(path: Path, *, links_known: bool = False) -> Any:
    """Reads a JSON file.

    Args:
        path: The file.
        links_known: Whether it has been seen already that no link leads out of its folder.

    Raises:
        RfgsError: The file does not exist.
        RfgsFormatError: The file is not JSON, which knows no NaN and no infinity.
    """
    try:
        return decoded_json(path, json_bytes(path, links_known=links_known))
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file") from error


def decoded_json(path: Path, data: bytes) -> Any:
    """Values of a JSON text.

    Raises:
        RfgsFormatError: It is no JSON; the message names `path`.
    """
    try:
        return msgspec.json.decode(data)
    except (ValueError, RecursionError) as error:
        raise RfgsFormatError(f"{path}: expected JSON, got something else ({error})") from error


def sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes."""
    refuse_link(path)
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def inside(root: Path, name: str) -> Path:
    """Joins `name` below `root`, refusing names that lead outside of it.

    Raises:
        RfgsFormatError: `name` is absolute or climbs out of `root`.
    """
    home = os.path.realpath(root)
    target = os.path.realpath(os.path.join(home, name))
    if target != home and not target.startswith(home.rstrip(os.sep) + os.sep):
        raise RfgsFormatError(f"{name!r} leads outside {root}; expected a name inside that folder")
    return Path(target)
