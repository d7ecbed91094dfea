# SPDX-License-Identifier: Apache-2.0
"""Chunks of a store before anything unpacks them: one zstd frame, as large as its array says.

The codec behind believes what a frame says of itself, and takes the sum of several: 60 kB can ask
for gigabytes. The format is RFC 8878.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import BinaryIO

from rfgs_core.errors import RfgsFormatError

#: Chunks take no more memory than this, or so many times what their file takes [bytes].
MOST_BYTES, MOST_PACKED = 2**28, 32
_MAGIC = b"\x28\xb5\x2f\xfd"
#: Bytes of a dictionary's number and of the content's size, by two bits of the descriptor.
_DICTIONARY, _SIZE = (0, 1, 2, 4), (0, 2, 4, 8)
#: What a block has at most, and how much shorter than that blocks are on average [bytes].
_BLOCK, _SHORTER = 2**17, 2**10
_RUN = 1


def refuse_chunk(file: Path | str, size: int) -> None:
    """Refuses a chunk that would unpack to another size than its array says.

    Args:
        file: The chunk.
        size: Bytes of the values of a whole chunk.

    Raises:
        FileNotFoundError: There is no such file.
        RfgsFormatError: It is no single zstd frame of that size, or packed beyond all measure.
    """
    # Stores have many of these, and a file without a buffer is opened in half the time.
    with open(file, "rb", buffering=0) as stream:
        _refuse(file, stream, os.fstat(stream.fileno()).st_size, size)


def _refuse(file: Path | str, stream: BinaryIO, taken: int, size: int) -> None:
    # What cannot be packed takes a three-byte head per block.
    if taken > size + size // 256 + 1024:
        raise RfgsFormatError(
            f"{file}: truncated or damaged CSI chunk (it takes {taken} bytes, its values {size})"
        )
    if size > max(MOST_BYTES, MOST_PACKED * taken):
        raise RfgsFormatError(
            f"{file}: {size} bytes packed into {taken}; expected up to {MOST_PACKED} times as many"
        )
    try:
        found = _content(stream, taken, size // _SHORTER + 16)
    except (IndexError, struct.error, ValueError) as error:
        raise RfgsFormatError(f"{file}: truncated or damaged CSI chunk ({error})") from error
    if found != size:
        raise RfgsFormatError(
            f"{file}: truncated or damaged CSI chunk (it says {found} bytes, its array {size})"
        )


def _content(stream: BinaryIO, taken: int, most_blocks: int) -> int:
    """Bytes that the frame of a file says it unpacks to.

    Raises:
        ValueError: It does not say, or the file holds something else than one frame.
    """
    head = stream.read(18)
    if head[:4] != _MAGIC:
        raise ValueError("no zstd frame")
    flags = head[4]
    single = flags >> 5 & 1
    width = _SIZE[flags >> 6] or single
    at = 5 + (not single) + _DICTIONARY[flags & 3]
    if not width or len(head) < at + width:
        raise ValueError("a zstd frame without its size")
    size = int.from_bytes(head[at : at + width], "little") + (256 if width == 2 else 0)
    at += width
    for _ in range(most_blocks):
        stream.seek(at)
        (block,) = struct.unpack("<I", stream.read(3) + b"\0")
        at += 3 + (1 if block >> 1 & 3 == _RUN else min(block >> 3, _BLOCK))
        if block & 1:
            break
    if at + (flags & 4) != taken:
        raise ValueError("not one zstd frame alone")
    return size
