# SPDX-License-Identifier: GPL-3.0-or-later
"""Files and folders that are either whole or absent."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import AddonError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a temporary name beside `path`; renames it to `path` if the block succeeds."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".tmp-{uuid.uuid4().hex[:8]}-{path.name}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def replacing_folder(path: Path, marker: str) -> Iterator[Path]:
    """Yields an empty folder beside `path` that takes its place if the block succeeds.

    Args:
        path: Folder to write; an older one is replaced if it holds a file `marker`.
        marker: Name of a file that only folders of this kind hold.

    Raises:
        AddonError: `path` holds something else.
    """
    path = Path(os.path.abspath(path))
    if path.exists() and not (path / marker).exists():
        if not path.is_dir() or any(path.iterdir()):
            raise AddonError(f"{path}: exists and holds no {marker}; choose another folder")
    temporary = path.with_name(f".tmp-{uuid.uuid4().hex[:8]}-{path.name}")
    temporary.mkdir(parents=True)
    old = temporary.with_name(temporary.name + "-old")
    try:
        yield temporary
        if path.exists():
            path.rename(old)
        temporary.rename(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def refuse_pipe(path: Path) -> None:
    """Refuses what is there and is no file: a pipe keeps its reader waiting for ever.

    Raises:
        AddonError: It is a pipe, a socket, a device or a folder.
    """
    if path.exists() and not path.is_file():
        raise AddonError(f"{path}: expected a file, found something else")


def write_json(path: Path, value: Any) -> None:
    """Writes `value` as indented JSON with sorted keys."""
    with replacing(path) as temporary:
        temporary.write_text(json_text(value), "utf-8")


def sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def sha256_below(folder: Path) -> dict[str, str]:
    """Digest of every file below a folder, by its name from there."""
    return {
        file.relative_to(folder).as_posix(): sha256(file)
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }


def json_text(value: Any) -> str:
    """Indented JSON with sorted keys."""
    return json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n"
