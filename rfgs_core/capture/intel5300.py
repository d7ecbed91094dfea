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

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many, unwrapped_s
from rfgs_core.capture.intel5300_kernel import (
    FIELDS,
    GROUPS,
    HEADER_BYTES,
    find_records,
    is_record,
    read_headers,
    unpack,
)
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.wifi_grid import INTEL_5300, SPACING_HZ

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
