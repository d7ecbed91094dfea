# SPDX-License-Identifier: GPL-3.0-or-later
"""PNG files without dates, render times and host names."""

from __future__ import annotations

import struct
from pathlib import Path

from ..errors import AddonError

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def strip_metadata(path: Path) -> None:
    """Keeps only the chunks that hold the picture, so equal pictures are equal bytes.

    Chunks are critical if their name starts with a capital (PNG specification, 5.4).

    Raises:
        AddonError: The file is not a whole PNG.
    """
    data = path.read_bytes()
    kept, at, name = [_SIGNATURE], len(_SIGNATURE), b""
    while data.startswith(_SIGNATURE) and at + 12 <= len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        if name[:1].isupper():
            kept.append(data[at : at + size + 12])
        at += size + 12
    if name != b"IEND":
        raise AddonError(f"{path}: expected a whole PNG; is the disk full?")
    path.write_bytes(b"".join(kept))
