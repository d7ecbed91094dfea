# SPDX-License-Identifier: Apache-2.0
"""Folders as they travel between the command and its workers, which share no disk."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path


def packed(folder: Path, without: str = "") -> bytes:
    """A folder's files as an archive.

    Args:
        folder: The folder.
        without: A folder in it that stays behind; empty takes everything.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(
        buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False
    ) as archive:
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder)
            if path.is_file() and name.parts[0] != without:
                archive.write(path, name.as_posix())
    return buffer.getvalue()


def unpack(data: bytes, folder: Path) -> None:
    """Writes an archive's files below a folder; none of them may lead out of it."""
    # Tar archives are only safe to unpack from Python 3.11.4 on, and Debian 12 has 3.11.2.
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(folder)
