# SPDX-License-Identifier: Apache-2.0
"""Compiled parts of the Intel 5300 reader: finding records and unpacking their bits."""

from __future__ import annotations

from numba import njit

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
