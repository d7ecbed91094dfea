# SPDX-License-Identifier: GPL-3.0-or-later
"""Scanline OpenEXR files of float channels, read and written with numpy.

Blender names and orders its channels differently from version to version and adds the date and
the render time, so what it writes is read here and written again under fixed names. Only what
Blender is told to write is understood: scanlines, no or ZIP compression, half or float.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from ..errors import AddonError
from ..files import replacing

_MAGIC = 20000630
_LINES = {0: 1, 2: 1, 3: 16}
_ZIPS, _ZIP = 2, 3
_DTYPES = {1: np.dtype("<f2"), 2: np.dtype("<f4"), 0: np.dtype("<u4")}


def read_exr(path: Path) -> dict[str, np.ndarray]:
    """Channels by name, each float32 [height, width].

    Raises:
        AddonError: The file is none of the kinds described above.
    """
    data = path.read_bytes()
    if len(data) < 8 or struct.unpack_from("<I", data)[0] != _MAGIC:
        raise AddonError(f"{path}: expected an OpenEXR file")
    header, start = _read_header(data)
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    compression = header["compression"][0]
    if compression not in _LINES or data[5] & 0x1A:
        raise AddonError(f"{path}: expected scanlines with ZIP compression in a single part")
    channels = _channels(header["channels"])
    out = {name: np.zeros((height, width), np.float32) for name, _ in channels}
    lines = _LINES[compression]
    blocks = -(-height // lines)
    for offset in struct.unpack_from(f"<{blocks}Q", data, start):
        y, size = struct.unpack_from("<ii", data, offset)
        rows = min(lines, y1 - y + 1)
        expected = rows * width * sum(dtype.itemsize for _, dtype in channels)
        chunk = data[offset + 8 : offset + 8 + size]
        if compression and size < expected:
            chunk = _unfilter(zlib.decompress(chunk))
        at = 0
        for row in range(y - y0, y - y0 + rows):
            for name, dtype in channels:
                out[name][row] = np.frombuffer(chunk, dtype, width, at)
                at += width * dtype.itemsize
    return out


def write_exr(path: Path, channels: dict[str, np.ndarray]) -> None:
    """Writes float32 channels, each [height, width], ZIP-compressed and without metadata."""
    names = sorted(channels)
    height, width = channels[names[0]].shape
    planes = np.stack([np.asarray(channels[name], "<f4") for name in names])  # [C, H, W]
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in names)
    header = struct.pack("<II", _MAGIC, 2 | (0x400 if max(map(len, names)) > 31 else 0)) + b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
        for name, kind, value in (
            (b"channels", b"chlist", listed + b"\0"),
            (b"compression", b"compression", bytes([_ZIP])),
            (b"dataWindow", b"box2i", window),
            (b"displayWindow", b"box2i", window),
            (b"lineOrder", b"lineOrder", b"\0"),
            (b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
            (b"screenWindowCenter", b"v2f", struct.pack("<ff", 0.0, 0.0)),
            (b"screenWindowWidth", b"float", struct.pack("<f", 1.0)),
        )
    )
    header += b"\0"
    blocks, offsets = [], []
    position = len(header) + 8 * -(-height // _LINES[_ZIP])
    for y in range(0, height, _LINES[_ZIP]):
        raw = planes[:, y : y + _LINES[_ZIP]].transpose(1, 0, 2).tobytes()
        packed = zlib.compress(_filter(raw), 6)
        packed = packed if len(packed) < len(raw) else raw
        offsets.append(position)
        blocks.append(struct.pack("<ii", y, len(packed)) + packed)
        position += len(blocks[-1])
    with replacing(path) as temporary:
        index = struct.pack(f"<{len(offsets)}Q", *offsets)
        temporary.write_bytes(header + index + b"".join(blocks))


def _read_header(data: bytes) -> tuple[dict[str, bytes], int]:
    """Attributes by name, and where the offset table starts."""
    attributes, at = {}, 8
    while data[at] != 0:
        name_end = data.index(b"\0", at)
        kind_end = data.index(b"\0", name_end + 1)
        size = struct.unpack_from("<i", data, kind_end + 1)[0]
        first = kind_end + 5
        attributes[data[at:name_end].decode()] = data[first : first + size]
        at = first + size
    return attributes, at + 1


def _channels(listed: bytes) -> list[tuple[str, np.dtype]]:
    found, at = [], 0
    while listed[at] != 0:
        end = listed.index(b"\0", at)
        kind = struct.unpack_from("<i", listed, end + 1)[0]
        found.append((listed[at:end].decode(), _DTYPES[kind]))
        at = end + 17
    return found


def _unfilter(packed: bytes) -> bytes:
    """Undoes EXR's byte differences and its split into even and odd bytes."""
    deltas = np.frombuffer(packed, np.uint8).astype(np.int64)
    deltas[1:] -= 128
    whole = np.cumsum(deltas).astype(np.uint8)
    half = (len(whole) + 1) // 2
    out = np.zeros(len(whole), np.uint8)
    out[0::2], out[1::2] = whole[:half], whole[half:]
    return out.tobytes()


def _filter(raw: bytes) -> bytes:
    plain = np.frombuffer(raw, np.uint8)
    whole = np.concatenate([plain[0::2], plain[1::2]]).astype(np.int16)
    deltas = whole.copy()
    deltas[1:] = whole[1:] - whole[:-1] + 128
    return deltas.astype(np.uint8).tobytes()
