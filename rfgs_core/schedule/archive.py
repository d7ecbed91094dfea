# SPDX-License-Identifier: Apache-2.0
"""Folders as they travel between the command and its workers, which share no disk."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Collection
from pathlib import Path

from rfgs_core.links import refuse_link


def packed(folder: Path, without: str = "", only: Collection[str] = ()) -> bytes:
    """A folder's files as an archive.

    Args:
        folder: The folder.
        without: A folder in it that stays behind; empty takes everything.
        only: Names in it that are taken; empty takes all.

    Raises:
        RfgsFormatError: A link leads out of a dataset or run, which there would be a plain file.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(
        buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False
    ) as archive:
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder)
            wanted = name.parts[0] != without and (not only or name.parts[0] in only)
            if wanted and path.is_file():
                refuse_link(path)
                archive.write(path, name.as_posix())
    return buffer.getvalue()


def unpack(data: bytes, folder: Path) -> None:
    """Writes an archive's files below a folder; none of them may lead out of it."""
    # Tar archives are only safe to unpack from Python 3.11.4 on, and Debian 12 has 3.11.2.
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(folder)
