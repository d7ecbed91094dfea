# SPDX-License-Identifier: Apache-2.0
"""FeitCSI captures of Intel AX200 and AX210, `.csi`.

Records of a 272-byte little-endian header (`include/Csi.h` of KuskoSoft/FeitCSI) and signed
16-bit real and imaginary parts, RX slowest, subcarrier fastest. Pilots come out near zero, and
160 MHz packets of raw firmware carry surplus samples in their middle, which are dropped.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from jaxtyping import Int64

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many, unwrapped_s
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.wifi_grid import SPACING_HZ, occupied, pilots
from rfgs_core.sanitize.gaps import fill_gaps

NAME = "feitcsi"
TITLE = "Intel AX200/AX210, FeitCSI"
SUFFIXES = (".csi",)

HEADER_BYTES = 272
_HEADER = np.dtype(
    {
        "names": ["ftm_clock", "time_us", "rssi_dbm", "source", "clock_us", "rate"],
        "formats": ["<u4", "<u8", ("<i4", 2), ("u1", 6), "<u4", "<u4"],
        "offsets": [8, 12, 60, 68, 88, 92],
        "itemsize": HEADER_BYTES,
    }
)
#: Bytes of values, RX, TX and subcarriers of a record.
_SIZES = struct.Struct("<I42xBB4xI")
_SUBCARRIERS = (52, 56, 114, 242, 484, 498, 996, 1992, 2020)
_FORMATS = ("CCK", "non-HT", "HT", "VHT", "HE", "EHT")
_WIDTHS_MHZ = (20, 40, 80, 160, 320)
#: Bits of the rate that tell format and width.
_KIND_MASK = 0x3F00
#: Samples of raw 160 MHz packets that stand for no subcarrier, by reported count.
_SURPLUS = {498: (242, 256), 2020: (996, 1024)}
#: Bytes that are searched at once for the next record.
_WINDOW = 1 << 20


def looks_like(head: bytes, _path: Path) -> bool:
    """Whether a file begins with a record."""
    return _size(head, 0) > 0


def read(path: Path) -> Reading:
    """Reads a capture.

    Returns:
        Channels (time, 1, rx, tx, subcarrier) as the card's integers, one capture for each
        format, width and number of antennas; pilots are interpolated and not `valid`.
        `packets` holds rssi_dbm (time, 2), ftm_clock [3.125 ns], clock_us, rate and source.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is empty, too large or holds no record.
    """
    return decode(path, read_bytes(path))


def is_record(data: bytes) -> bool:
    """Whether bytes are one whole record."""
    return 0 < _size(data, 0) == len(data)


def decode(path: Path, data: bytes) -> Reading:
    """Reads records that are at hand; see `read`.

    Args:
        path: Where they are from, for messages.
        data: The records.

    Raises:
        RfgsFormatError: They hold no record, or too many.
    """
    places, damage = _places(data)
    groups: dict[tuple[int, int, int, int], list[int]] = {}
    for place in places:
        _, num_rx, num_tx, count = _SIZES.unpack_from(data, place)
        kind = int.from_bytes(data[place + 92 : place + 96], "little") & _KIND_MASK
        groups.setdefault((num_rx, num_tx, count, kind), []).append(place)
    captures = []
    for (num_rx, num_tx, count, kind), found in groups.items():
        form, width = _kind(kind)
        index = occupied(form, width)
        if index is None or len(index) != count - _dropped(count):
            unknown = f"packets of an unknown format ({form} {width} MHz, {count} subcarriers)"
            damage[unknown] = damage.get(unknown, 0) + len(found)
            continue
        sizes = num_rx, num_tx, count
        captures.append(_capture(path, data, np.array(found), sizes, form, width, index))
    return reading(path, NAME, captures, damage)


def _size(data: bytes, at: int) -> int:
    """Bytes of the record at a place, 0 where none can begin."""
    if at + HEADER_BYTES > len(data):
        return 0
    size, num_rx, num_tx, count = _SIZES.unpack_from(data, at)
    fits = 1 <= num_rx <= 4 and 1 <= num_tx <= 4 and count in _SUBCARRIERS
    return HEADER_BYTES + size if fits and size == 4 * num_rx * num_tx * count else 0


def _places(data: bytes) -> tuple[list[int], dict[str, int]]:
    """First byte of every whole record, and what was passed over."""
    places, at, lost, cut = [], 0, 0, 0
    while at < len(data):
        size = _size(data, at)
        if size and at + size <= len(data):
            places.append(at)
            at += size
            continue
        following = _next_place(data, at + 1)
        if size and following == len(data):
            cut = 1
        else:
            lost += following - at
        at = following
    return places, {"bytes that belong to no record": lost, "record cut off at the end": cut}


def _next_place(data: bytes, start: int) -> int:
    """The next place where a whole record can begin; the end where there is none."""
    for first in range(start, max(len(data) - HEADER_BYTES, start), _WINDOW):
        last = min(first + _WINDOW, len(data) - HEADER_BYTES + 1)
        part = np.frombuffer(data, np.uint8, last - first + 56, first).astype(np.uint32)
        count = last - first
        words = part[:-3] | part[1:-2] << 8 | part[2:-1] << 16 | part[3:] << 24
        size, subcarriers = words[:count], words[52 : 52 + count]
        num_rx, num_tx = part[46 : 46 + count], part[47 : 47 + count]
        fits = np.isin(subcarriers, _SUBCARRIERS) & (num_rx >= 1) & (num_rx <= 4)
        fits &= (num_tx >= 1) & (num_tx <= 4)
        fits[fits] = size[fits] == 4 * num_rx[fits] * num_tx[fits] * subcarriers[fits]
        for offset in np.flatnonzero(fits):
            place = first + int(offset)
            if place + _size(data, place) <= len(data):
                return place
    return len(data)


def _kind(rate: int) -> tuple[str, int]:
    """Packet format and width [MHz] that a rate tells."""
    form, width = (rate >> 8) & 7, (rate >> 11) & 7
    return (
        _FORMATS[form] if form < len(_FORMATS) else f"format {form}",
        _WIDTHS_MHZ[width] if width < len(_WIDTHS_MHZ) else 0,
    )


def _dropped(count: int) -> int:
    first, last = _SURPLUS.get(count, (0, 0))
    return last - first


def _capture(
    path: Path,
    data: bytes,
    places: Int64[np.ndarray, "time"],
    sizes: tuple[int, int, int],
    form: str,
    width_mhz: int,
    index: Int64[np.ndarray, "subcarrier"],
) -> Capture:
    num_rx, num_tx, count = sizes
    shape = (len(places), num_rx, num_tx, count)
    refuse_too_many(path, int(np.prod(shape)))
    raw = np.zeros((len(places), num_rx * num_tx * count * 2), np.int16)
    header = np.zeros(len(places), _HEADER)
    for row, place in enumerate(places):
        header[row] = np.frombuffer(data, _HEADER, 1, place)[0]
        raw[row] = np.frombuffer(data, "<i2", raw.shape[1], place + HEADER_BYTES)
    values = raw.astype(np.float32).view(np.complex64).reshape(shape)
    if count in _SURPLUS:
        values = np.delete(values, slice(*_SURPLUS[count]), axis=-1)
    measured = ~np.isin(index, pilots(form, width_mhz))
    values = fill_gaps(values, measured, index)
    # One clock for all packets: the tool's own where it is set, else the card's.
    time_s = (
        unwrapped_s(header["time_us"].astype(np.int64), 62, 1e-6)
        if header["time_us"].any()
        else unwrapped_s(header["clock_us"].astype(np.int64), 32, 1e-6)
    )
    return Capture(
        source=NAME,
        values=values[:, None],
        valid=np.broadcast_to(measured, values.shape).copy()[:, None],
        time_s=time_s,
        axis="subcarrier",
        bins=index * SPACING_HZ[form],
        index=index,
        packets={
            "rssi_dbm": -header["rssi_dbm"].astype(np.float64),
            **{name: header[name].copy() for name in ("ftm_clock", "clock_us", "rate", "source")},
        },
        info={"bandwidth_mhz": width_mhz, "format": form},
    )
