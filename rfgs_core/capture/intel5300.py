# SPDX-License-Identifier: Apache-2.0
"""Intel 5300 captures of the Linux 802.11n CSI Tool (Halperin et al. 2011), `.dat`.

A stream of records: u16 length (big-endian), u8 code, content. Code 0xBB is a channel:
little-endian u32 timestamp [µs], u16 count, u16 zero, u8 rx, u8 tx, three u8 RSSI, i8 noise, u8
gain, u8 antenna selection, u16 length, u16 rate, then the bits (`netlink/iwl_nl.h` and
`matlab/read_bfee.c` of dhalperi/linux-80211n-csitool-supplementary say so). Channels stand in the
order of RX chains; the antenna selection tells which antenna each chain was on, and it changes
from packet to packet.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Int64, UInt8
from numba import njit

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many, unwrapped_s
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.wifi_grid import INTEL_5300, SPACING_HZ

#: Bytes of a record before its bits: length, code and the driver's header.
HEADER_BYTES = 23
#: Reported groups of subcarriers.
GROUPS = 30

#: Columns of the table of headers.
FIELDS = (
    *("timestamp_us", "sequence", "num_rx", "num_tx"),
    *("rssi_a_db", "rssi_b_db", "rssi_c_db", "noise_dbm", "agc_db", "rate"),
)

_CSI, _PAYLOAD = 0xBB, 0xC1


@njit(cache=True, inline="always")
def _csi_bytes(num_rx, num_tx):
    """Bytes of the bit stream: 30 × (3 + 16 · rx · tx) bits, rounded up."""
    return (GROUPS * (3 + 16 * num_rx * num_tx) + 7) // 8


@njit(cache=True)
def is_record(data, at):
    """Length of the record at a place, 0 where none can begin there."""
    size = data.shape[0]
    if at + 3 > size:
        return 0
    length = (data[at] << 8) + data[at + 1]
    code = data[at + 2]
    if code == _PAYLOAD:
        end = at + 2 + length
        # A payload tells nothing of itself: what follows must begin like a record.
        if length < 1 or end > size:
            return 0
        after = end == size or (
            end + 3 <= size and (data[end + 2] == _CSI or data[end + 2] == _PAYLOAD)
        )
        return length + 2 if after else 0
    if code != _CSI or at + HEADER_BYTES > size:
        return 0
    num_rx, num_tx = data[at + 11], data[at + 12]
    if num_rx < 1 or num_rx > 3 or num_tx < 1 or num_tx > 3:
        return 0
    stated = data[at + 19] + (data[at + 20] << 8)
    expected = _csi_bytes(num_rx, num_tx)
    if stated != expected or length != expected + HEADER_BYTES - 2:
        return 0
    return length + 2


@njit(cache=True)
def find_records(data, places):
    """Fills the places of whole channel records.

    Args:
        data: The file, (byte,) uint8.
        places: Filled with the first byte of each record, int64; long enough for all.

    Returns:
        Number of records, bytes that belong to none, and whether the last one is cut off.
    """
    at, found, lost, cut = 0, 0, 0, 0
    size = data.shape[0]
    while at < size:
        length = is_record(data, at)
        if length == 0:
            lost += 1
            at += 1
            continue
        if at + length > size:
            cut = 1
            break
        if data[at + 2] == _CSI:
            places[found] = at
            found += 1
        at += length
    return found, lost, cut


@njit(cache=True)
def read_headers(data, places, table, ports):
    """Reads the driver's header of each record.

    Args:
        data: The file, (byte,) uint8.
        places: First byte of each record, (time,).
        table: Filled, (time, field) int64, in the order of `FIELDS`.
        ports: Filled with the antenna of each RX chain, (time, 3) int64; the order of chains
            where the selection names an antenna twice or one that is not there.

    Returns:
        Number of such records.
    """
    unclear = 0
    for time in range(places.shape[0]):
        at = places[time]
        low = int(data[at + 3]) | (int(data[at + 4]) << 8)
        table[time, 0] = low | (int(data[at + 5]) << 16) | (int(data[at + 6]) << 24)
        table[time, 1] = int(data[at + 7]) | (int(data[at + 8]) << 8)
        for field in range(5):
            table[time, 2 + field] = data[at + 11 + field]
        table[time, 7] = int(data[at + 16]) - ((int(data[at + 16]) & 0x80) << 1)
        table[time, 8] = data[at + 17]
        table[time, 9] = int(data[at + 21]) | (int(data[at + 22]) << 8)
        seen, clear = 0, True
        for chain in range(data[at + 11]):
            port = (int(data[at + 18]) >> (2 * chain)) & 3
            clear = clear and port < 3 and not (seen >> port) & 1
            seen |= 1 << port
            ports[time, chain] = port
        if not clear:
            unclear += 1
            for chain in range(3):
                ports[time, chain] = chain
    return unclear


@njit(cache=True)
def unpack(data, places, ports, values, valid):
    """Unpacks the bit streams of records.

    Each group is 3 bits that say nothing, then for each RX chain and TX stream a signed byte
    real and one imaginary, least significant bit first.

    Args:
        data: The file, (byte,) uint8.
        places: First byte of each record, (time,).
        ports: Antenna of each RX chain, (time, 3).
        values: Filled, (time, rx, tx, 60) float32, real and imaginary in turn.
        valid: Filled, (time, rx, tx, 30) bool.
    """
    for time in range(places.shape[0]):
        at = places[time]
        num_rx, num_tx = data[at + 11], data[at + 12]
        first = at + HEADER_BYTES
        for chain in range(num_rx):
            port = ports[time, chain]
            for stream in range(num_tx):
                bit = 3 + 16 * (chain * num_tx + stream)
                for group in range(GROUPS):
                    byte, shift = first + (bit >> 3), bit & 7
                    low = int(data[byte]) | (int(data[byte + 1]) << 8)
                    if shift:
                        low |= int(data[byte + 2]) << 16
                    low >>= shift
                    real, imaginary = low & 0xFF, (low >> 8) & 0xFF
                    values[time, port, stream, 2 * group] = real - ((real & 0x80) << 1)
                    values[time, port, stream, 2 * group + 1] = imaginary - (
                        (imaginary & 0x80) << 1
                    )
                    valid[time, port, stream, group] = True
                    bit += 3 + 16 * num_rx * num_tx


NAME = "intel5300"
TITLE = "Intel 5300, Linux 802.11n CSI Tool"
SUFFIXES = (".dat",)

#: Noise floor that stands for "not measured" [dBm].
_NO_NOISE_DBM = -127
_UNCLEAR = "packets with an unclear antenna selection, left in the order of chains"
#: Bit of the rate that says 40 MHz.
_RATE_40_MHZ = 0x800
#: Shortest record of a channel [bytes]: one RX, one TX.
_SHORTEST = HEADER_BYTES + (GROUPS * 19 + 7) // 8


def looks_like(head: bytes, path: Path) -> bool:
    """Whether a file begins with a record, or has the suffix and one soon after."""
    data = np.frombuffer(head, np.uint8)
    if is_record(data, 0) and head[2] == 0xBB:
        return True
    if path.suffix.lower() not in SUFFIXES:
        return False
    return any(is_record(data, at) for at in range(len(data)))


def read(path: Path) -> Reading:
    """Reads a capture; antennas are those of the card, not the order of its chains.

    Returns:
        Channels (time, 1, rx, tx, 30) as signed integers of the card, one capture for each
        bandwidth. `packets` holds rssi_db (time, 3) relative to the card's reference, 0 = none;
        noise_dbm, NaN where it was not measured; agc_db, sequence and rate.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is empty, too large or holds no record.
    """
    data = np.frombuffer(read_bytes(path), np.uint8)
    places = np.zeros(len(data) // _SHORTEST + 1, np.int64)
    count, lost, cut = find_records(data, places)
    places = places[:count]
    damage = {"bytes that belong to no record": lost, "record cut off at the end": cut}
    table, ports = np.zeros((count, len(FIELDS)), np.int64), np.full((count, 3), -1)
    damage[_UNCLEAR] = read_headers(data, places, table, ports)
    wide = (table[:, FIELDS.index("rate")] & _RATE_40_MHZ) != 0
    captures = [
        _capture(path, data, places[rows], table[rows], ports[rows], bandwidth)
        for rows, bandwidth in ((~wide, 20), (wide, 40))
        if rows.any()
    ]
    return reading(path, NAME, captures, damage)


def _capture(
    path: Path,
    data: UInt8[np.ndarray, "byte"],
    places: Int64[np.ndarray, "time"],
    table: Int64[np.ndarray, "time field"],
    ports: Int64[np.ndarray, "time 3"],
    bandwidth_mhz: int,
) -> Capture:
    header = {name: table[:, column] for column, name in enumerate(FIELDS)}
    rssi = FIELDS.index("rssi_a_db")
    shape = (len(places), int(ports.max()) + 1, int(header["num_tx"].max()), GROUPS)
    refuse_too_many(path, int(np.prod(shape)))
    values, valid = np.zeros(shape, np.complex64), np.zeros(shape, bool)
    unpack(data, places, ports, values.view(np.float32), valid)
    index = np.array(INTEL_5300[bandwidth_mhz], np.int64)
    noise_dbm = header["noise_dbm"].astype(np.float64)
    noise_dbm[noise_dbm == _NO_NOISE_DBM] = np.nan
    return Capture(
        source=NAME,
        values=values[:, None],
        valid=valid[:, None],
        time_s=unwrapped_s(header["timestamp_us"], 32, 1e-6),
        axis="subcarrier",
        bins=index * SPACING_HZ["HT"],
        index=index,
        packets={
            "rssi_db": table[:, rssi : rssi + 3].astype(np.float64),
            "noise_dbm": noise_dbm,
            "agc_db": header["agc_db"].astype(np.float64),
            "antenna": ports,
            **{name: header[name] for name in ("sequence", "timestamp_us", "rate")},
            **{name: header[name] for name in ("num_rx", "num_tx")},
        },
        info={"bandwidth_mhz": bandwidth_mhz, "format": "HT"},
    )
