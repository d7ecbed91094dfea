# SPDX-License-Identifier: Apache-2.0
"""Reads EXR pictures as datasets hold them: one part of scan lines, floats, plain or zip.

The library reads much more, and a damaged header ends the whole process in its C++; so what may
come from anywhere is read here, with every number of the file held against its size.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

_MAGIC = b"\x76\x2f\x31\x01\x02\x00\x00\x00"
#: Scan lines in a chunk, by the number of the compression: none, zip of one line, zip of 16.
_LINES = {0: 1, 2: 1, 3: 16}
#: Type of a channel's numbers, by its own number: half and single precision.
_KINDS = {1: "<f2", 2: "<f4"}
_MOST_CHANNELS = 64
#: What all channels take as float32, and what their file takes, at most [bytes].
MOST_BYTES = 400_000_000


@dataclass(frozen=True)
class _Header:
    channels: list[tuple[str, str]]
    """Name and NumPy type, in the order of the file."""
    width: int
    height: int
    first: int
    """Number of the top line."""
    lines: int
    """Lines in a chunk; zipped if `zipped`."""
    zipped: bool
    size: int
    """Bytes that it takes itself."""


def decode_exr(data: bytes, most_pixels: int) -> dict[str, Float32[np.ndarray, "h w"]]:
    """Every channel of an EXR file as float32.

    Args:
        data: The file.
        most_pixels: Largest picture that is read.

    Raises:
        ValueError: It is damaged, or of a kind that datasets do not hold.
    """
    header = _header(data, most_pixels)
    count = -(-header.height // header.lines)
    offsets = struct.unpack_from(f"<{count}Q", data, header.size)
    row = np.dtype([(name, kind, (header.width,)) for name, kind in header.channels])
    table = np.zeros(header.height, row)
    for index, offset in enumerate(offsets):
        top = index * header.lines
        lines = min(header.lines, header.height - top)
        packed = _chunk(data, offset, header.first + top, lines * row.itemsize, header.zipped)
        table[top : top + lines] = np.frombuffer(packed, row)
    return {name: table[name].astype(np.float32) for name, _ in header.channels}


def _chunk(data: bytes, offset: int, line: int, size: int, zipped: bool) -> bytes:
    """Bytes of the lines of a chunk."""
    found, length = struct.unpack_from("<ii", data, min(offset, len(data)))
    packed = data[offset + 8 : offset + 8 + length]
    if found != line or not 0 < length <= size or len(packed) != length:
        raise ValueError(f"the chunk of line {line} is cut short or of another line")
    if length == size:
        return packed
    unpacker = zlib.decompressobj()
    plain = unpacker.decompress(packed, size) if zipped else b""
    # Only now does it look at the checksum behind.
    plain += unpacker.decompress(unpacker.unconsumed_tail, 1) if zipped else b""
    if len(plain) != size or not unpacker.eof:
        raise ValueError(f"the chunk of line {line} holds {len(plain)} bytes, expected {size}")
    # Differences of neighbours around 128; then bytes of even places before those of odd ones.
    steps = np.frombuffer(plain, np.uint8).astype(np.uint64)
    steps[1:] += 128
    values = np.cumsum(steps).astype(np.uint8)
    spread = np.zeros(size, np.uint8)
    half = (size + 1) // 2
    spread[0::2], spread[1::2] = values[:half], values[half:]
    return spread.tobytes()


def _header(data: bytes, most_pixels: int) -> _Header:
    if data[:8] != _MAGIC:
        raise ValueError("expected one part of scan lines")
    attributes, at = _attributes(data)
    low_x, low_y, high_x, high_y = struct.unpack("<4i", attributes["dataWindow"])
    width, height = high_x - low_x + 1, high_y - low_y + 1
    if width < 1 or height < 1 or width * height > most_pixels:
        raise ValueError(f"a picture of {width} x {height} pixels is too large")
    compression, order = attributes["compression"][0], attributes["lineOrder"][0]
    if compression not in _LINES or order != 0:
        raise ValueError("expected lines from top to bottom, plain or zipped")
    channels = _channels(attributes["channels"])
    room = (len(data) - at) * (1100 if compression else 1)
    if math.prod((width, height, len(channels), 4)) > MOST_BYTES:
        raise ValueError(f"{len(channels)} channels of {width} x {height} pixels are too large")
    if math.prod((width, height, len(channels), 2)) > room:
        raise ValueError(f"a picture of {width} x {height} pixels does not fit into it")
    return _Header(channels, width, height, low_y, _LINES[compression], compression != 0, at)


def _attributes(data: bytes) -> tuple[dict[str, bytes], int]:
    """What the header says by name, and where it ends."""
    found, at = {}, len(_MAGIC)
    while data[at : at + 1] != b"\0":
        name, _, _ = data[at : at + 256].partition(b"\0")
        kind, _, _ = data[at + len(name) + 1 : at + len(name) + 257].partition(b"\0")
        at += len(name) + len(kind) + 2
        (length,) = struct.unpack_from("<i", data, at)
        at += 4
        if not 0 <= length <= len(data) - at or name.decode("ascii") in found:
            raise ValueError(f"the attribute {name!r} is cut short or stands twice")
        found[name.decode("ascii")] = data[at : at + length]
        at += length
    return found, at + 1


def _channels(table: bytes) -> list[tuple[str, str]]:
    """Name and type of every channel."""
    found, at = [], 0
    while table[at : at + 1] != b"\0":
        name, _, _ = table[at : at + 256].partition(b"\0")
        at += len(name) + 1
        kind, _, across, down = struct.unpack_from("<iIii", table, at)
        at += 16
        if kind not in _KINDS or (across, down) != (1, 1) or len(found) == _MOST_CHANNELS:
            raise ValueError("expected channels of floats, one for every pixel")
        found.append((name.decode("ascii"), _KINDS[kind]))
    if len(dict(found)) != len(found) or not found:
        raise ValueError("expected channels with names of their own")
    return found
