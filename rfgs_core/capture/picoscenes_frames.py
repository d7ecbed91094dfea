# SPDX-License-Identifier: Apache-2.0
"""Frames and segments of PicoScenes files: found, bounded, and told apart by their versions.

A frame is `u32 length, u32 0x20150315, u16 version, u8 number of segments`, then segments of
`u32 length, u8 length of the name, name, u16 version, content`, all little-endian (Jiang et al.
2022; `ModularPicoScenesFrame.cxx`, `RxSBasicSegment.cxx` and `CSISegment.cxx` of
wifisensing/RXS-Parsing-Core). Versions decide the layout and are looked at first: reading a newer
one as an older one ends in made-up sizes.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

#: Bytes 4 to 7 of every frame.
MAGIC = (0x20150315).to_bytes(4, "little")
FORMATS = ("non-HT", "HT", "VHT", "HE", "HE", "EHT")

_FRAME = struct.Struct("<I4sHB")
_MOST_SEGMENTS = 32

#: `RxSBasic` by version. All begin with device and clock [µs]; then come centre [MHz] and, at the
#: end of the part below, number of RX antennas; the rest differs.
_BASIC = {
    1: (struct.Struct("<HQhBHHBBBBbBBBB"), {"centre": 2, "noise": 10, "rssi": 11}),
    2: (struct.Struct("<HQhBHHBBBBBBbBBBB"), {"centre": 2, "noise": 12, "rssi": 13}),
    3: (struct.Struct("<HQhhhBHHBBBBBBbbbbb"), {"centre": 2, "noise": 14, "rssi": 15}),
    4: (struct.Struct("<HQQhhhBHHBBBBBBbbbbb"), {"centre": 3, "noise": 15, "rssi": 16}),
    5: (struct.Struct("<HQQhhhHBHHBBBBBBbb8b"), {"centre": 3, "noise": 16, "rssi": 17}),
}

#: `CSI` by version: device, (firmware,) format, width [MHz], carrier, sampling rate, spacing,
#: subcarriers, TX streams, RX, extra streams, (number of channels,) antenna selection, (offset,)
#: bytes that follow.
_CSI = {
    1: struct.Struct("<HBHQQIHBBBBI"),
    2: struct.Struct("<HBHQQIHBBBBhI"),
    3: struct.Struct("<HBHQQIHBBBHBhI"),
    4: struct.Struct("<HBBHQQIHBBBHBhI"),
}


@dataclass(frozen=True)
class Frame:
    """What a frame tells of one packet, still in the device's own coding."""

    device: int
    form: int
    width_mhz: int
    carrier_hz: int
    spacing_hz: int
    count: int
    num_tx: int
    num_rx: int
    num_extra: int
    selection: int
    offset: int
    payload: bytes
    clock_us: int
    centre_mhz: int
    noise_dbm: int
    rssi_dbm: int


def frames(data: bytes, damage: dict[str, int]) -> Iterator[Frame]:
    """Goes through the frames of a file that hold a channel.

    Args:
        data: The file.
        damage: Counts what was passed over, by kind in words.
    """
    at, size = 0, len(data)
    while at < size:
        begin, end = _bounds(data, at)
        if end < 0:
            following = data.find(MAGIC, at + 5) - 4
            following = following if following > at else size
            if begin > at and following == size:
                _count(damage, "record cut off at the end", 1)
            else:
                _count(damage, "bytes that belong to no record", following - at)
            at = following
            continue
        frame = _frame(data[at:end], damage)
        if frame is not None:
            yield frame
        at = end


def is_frame(data: bytes) -> bool:
    """Whether bytes begin like a frame."""
    return len(data) >= _FRAME.size and data[4:8] == MAGIC


def is_whole_frame(data: bytes) -> bool:
    """Whether bytes are one frame and nothing else."""
    return _bounds(data, 0)[1] == len(data)


def _bounds(data: bytes, at: int) -> tuple[int, int]:
    """First byte after a frame's header and after the frame; (at, −1) where none begins.

    A frame that is cut off gives its header's end and −1.
    """
    if at + _FRAME.size > len(data):
        return at, -1
    length, magic, _, segments = _FRAME.unpack_from(data, at)
    if magic != MAGIC or segments > _MOST_SEGMENTS or length < _FRAME.size - 4:
        return at, -1
    end = at + 4 + length
    return at + _FRAME.size, end if end <= len(data) else -1


def _frame(data: bytes, damage: dict[str, int]) -> Frame | None:
    """Reads the segments that matter; None where the frame holds no channel that can be read."""
    at, basic, csi = _FRAME.size, None, None
    for _ in range(data[_FRAME.size - 1]):
        if at + 5 > len(data):
            break
        length, name_length = struct.unpack_from("<IB", data, at)
        begin, end = at + 5 + name_length + 2, at + 4 + length
        if begin > end or end > len(data):
            break
        name = data[at + 5 : at + 5 + name_length].rstrip(b"\0")
        version = int.from_bytes(data[begin - 2 : begin], "little")
        if name == b"RxSBasic":
            basic = _basic(data[begin:end], version, damage)
        elif name == b"CSI":
            csi = _csi(data[begin:end], version, damage)
        at = end
    if basic is None or csi is None:
        _count(damage, "packets without a channel that can be read", 1)
        return None
    return Frame(**csi, **basic)


def _basic(content: bytes, version: int, damage: dict[str, int]) -> dict[str, Any] | None:
    if version not in _BASIC or len(content) < _BASIC[version][0].size:
        _count(damage, f"packets with a segment RxSBasic of version {version}", 1)
        return None
    layout, where = _BASIC[version]
    row = layout.unpack_from(content)
    noise, rssi = row[where["noise"]], row[where["rssi"]]
    return {
        "clock_us": row[1],
        "centre_mhz": row[where["centre"]],
        "noise_dbm": noise,
        # Versions 1 and 2 count from the noise floor.
        "rssi_dbm": noise + rssi if version < 3 else rssi,
    }


def _csi(content: bytes, version: int, damage: dict[str, int]) -> dict[str, Any] | None:
    if version not in _CSI or len(content) < _CSI[version].size:
        _count(damage, f"packets with a segment CSI of version {version}", 1)
        return None
    row = list(_CSI[version].unpack_from(content))
    if version >= 4:
        del row[1]
    names = ("device", "form", "width_mhz", "carrier_hz", "_", "spacing_hz", "count", "num_tx")
    found: dict[str, Any] = dict(zip((*names, "num_rx", "num_extra"), row, strict=False))
    del found["_"]
    length, payload = row[-1], content[_CSI[version].size :]
    if length > len(payload):
        _count(damage, "packets whose channel is cut off", 1)
        return None
    found["offset"] = row[-2] if version >= 2 else 0
    found["selection"] = row[-3] if version >= 2 else row[-2]
    return {**found, "payload": payload[:length]}


def _count(damage: dict[str, int], kind: str, count: int) -> None:
    damage[kind] = damage.get(kind, 0) + count
