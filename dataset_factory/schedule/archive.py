# SPDX-License-Identifier: Apache-2.0
"""Folders as they travel between the command and its workers, which share no disk."""

from __future__ import annotations

import io
import tarfile
from pathlib import Path


def packed(folder: Path, without: str = "") -> bytes:
    """A folder's files as an archive.

    Args:
        folder: The folder.
        without: A folder in it that stays behind; empty takes everything.
    """
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz", compresslevel=1) as archive:
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder)
            if path.is_file() and name.parts[0] != without:
                archive.add(path, name.as_posix())
    return buffer.getvalue()


def unpack(data: bytes, folder: Path) -> None:
    """Writes an archive's files below a folder; none of them may lead out of it."""
    with tarfile.open(fileobj=io.BytesIO(data), mode="r:gz") as archive:
        archive.extractall(folder, filter="data")
