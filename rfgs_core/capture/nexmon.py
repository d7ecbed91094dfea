# SPDX-License-Identifier: Apache-2.0
"""Nexmon captures of Broadcom chips (Schulz et al. 2018), `.pcap`.

UDP packets to port 5500 whose payload is `u16 0x1111, i8 RSSI, u8 frame control (older firmware:
0x1111 again), 6 bytes source, u16 sequence, u16 core and stream, u16 chanspec, u16 chip`, then one
32-bit word per bin of the FFT (`src/csi_extractor.c` of seemoo-lab/nexmon_csi): two 16-bit
integers, or on BCM4358 and BCM4366c0 two mantissas with a common exponent.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Complex64, UInt32

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.wifi_grid import SPACING_HZ, channel_hz, occupied

NAME = "nexmon"
TITLE = "Broadcom, nexmon_csi"
SUFFIXES = (".pcap",)

#: First bytes of a capture → byte order and ticks per second.
_MAGIC = {
    b"\xd4\xc3\xb2\xa1": ("<", 1_000_000),
    b"\xa1\xb2\xc3\xd4": (">", 1_000_000),
    b"\x4d\x3c\xb2\xa1": ("<", 1_000_000_000),
    b"\xa1\xb2\x3c\x4d": (">", 1_000_000_000),
}
_FILE_HEADER, _RECORD_HEADER, _CSI_HEADER = 24, 16, 18
#: Longest packet that a capture tool keeps by default [bytes].
_LONGEST = 262_144
_PORT = 5500
#: Bits of the width in a chanspec → MHz (`D11AC` of Broadcom's `bcmwifi_channels.h`).
_WIDTHS_MHZ = {2: 20, 3: 40, 4: 80}
#: Mantissa and exponent bits of chips with floating-point channels.
_FLOATS = {"4358": (9, 5), "4366c0": (12, 6)}
#: Chips by the number that the firmware writes.
_CHIPS = {
    **{0x0001: "4339", 0x0065: "43455c0", 0xA6DC: "43455c0"},
    **{0x0003: "4358", 0xDEAD: "4358", 0x006A: "4366c0", 0xE834: "4366c0"},
}


@dataclass(frozen=True)
class _Packet:
    time_s: float
    rssi_dbm: float
    sequence: int
    core: int
    stream: int
    chanspec: int
    chip: int
    words: bytes


def looks_like(head: bytes, _path: Path) -> bool:
    """Whether a file is a packet capture."""
    return head[:4] in _MAGIC


def read(path: Path) -> Reading:
    """Reads a capture; the chip is told by what the packets hold.

    Returns:
        Channels (time, 1, core, stream, bin), bins ascending in frequency, one capture for each
        channel and number of bins. Nulls are not `valid` and stay 0: around the centre the chip
        reports spurious values of up to 10⁴. Packets of one sequence number are one time.
        `packets` holds rssi_dbm (NaN with older firmware) and sequence.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is empty, too large or holds no channel.
    """
    data = read_bytes(path)
    damage: dict[str, int] = {}
    groups: dict[tuple[int, int, int], list[_Packet]] = {}
    for packet in _packets(data, damage):
        key = (packet.chanspec, packet.chip, len(packet.words))
        groups.setdefault(key, []).append(packet)
    captures = [_capture(path, packets) for packets in groups.values()]
    return reading(path, NAME, captures, damage)


def _packets(data: bytes, damage: dict[str, int]) -> Iterator[_Packet]:
    if data[:4] not in _MAGIC or len(data) < _FILE_HEADER:
        return
    order, ticks = _MAGIC[data[:4]]
    header = struct.Struct(f"{order}IIII")
    at, others, cut = _FILE_HEADER, 0, 0
    while at < len(data):
        if at + _RECORD_HEADER > len(data):
            cut = 1
            break
        seconds, fraction, kept, _ = header.unpack_from(data, at)
        begin = at + _RECORD_HEADER
        if kept > _LONGEST or begin + kept > len(data):
            cut = 1
            break
        packet = _packet(data[begin : begin + kept], seconds + fraction / ticks)
        at = begin + kept
        if packet is None:
            others += 1
        else:
            yield packet
    damage["record cut off or damaged, the rest left out"] = cut
    damage["packets that hold no channel"] = others


def _packet(data: bytes, time_s: float) -> _Packet | None:
    """A channel in an Ethernet packet; None where there is none."""
    if len(data) < 42 or data[12:14] != b"\x08\x00" or data[23] != 17:
        return None
    begin = 14 + 4 * (data[14] & 15) + 8
    payload = data[begin:]
    bins = (len(payload) - _CSI_HEADER) // 4
    port = int.from_bytes(data[begin - 6 : begin - 4], "big")
    if port != _PORT or payload[:2] != b"\x11\x11" or bins not in (64, 128, 256):
        return None
    sequence, where, chanspec, chip = struct.unpack_from("<HHHH", payload, 10)
    old = payload[2:4] == b"\x11\x11"
    rssi_dbm = float("nan") if old else float(struct.unpack_from("b", payload, 2)[0])
    words = payload[_CSI_HEADER : _CSI_HEADER + 4 * bins]
    core, stream = where & 7, (where >> 3) & 7
    return _Packet(time_s, rssi_dbm, sequence, core, stream, chanspec, chip, words)


def _capture(path: Path, packets: list[_Packet]) -> Capture:
    first = packets[0]
    words = np.frombuffer(b"".join(packet.words for packet in packets), "<u4")
    words = words.reshape(len(packets), -1)
    chip = _chip(first.chip, words)
    bins = words.shape[1]
    channels = np.fft.fftshift(unpack_words(words, chip), axes=1)
    index = np.arange(bins) - bins // 2
    rows, times = _times(packets)
    shape = (
        times,
        1 + max(packet.core for packet in packets),
        1 + max(packet.stream for packet in packets),
        bins,
    )
    refuse_too_many(path, int(np.prod(shape)))
    used = np.isin(index, _used(bins))
    values, valid = np.zeros(shape, np.complex64), np.zeros(shape, bool)
    time_s, rssi_dbm, sequence = np.zeros(times), np.zeros(times), np.zeros(times, np.int64)
    for number, (row, packet) in enumerate(zip(rows, packets, strict=True)):
        values[row, packet.core, packet.stream] = channels[number] * used
        valid[row, packet.core, packet.stream] = used
        rssi_dbm[row], sequence[row] = packet.rssi_dbm, packet.sequence
        time_s[row] = packet.time_s
    number = first.chanspec & 0xFF
    return Capture(
        source=NAME,
        values=values[:, None],
        valid=valid[:, None],
        time_s=np.maximum.accumulate(time_s - time_s[0]),
        axis="subcarrier",
        bins=index * SPACING_HZ["VHT"],
        index=index,
        centre_hz=channel_hz(number, 5 if first.chanspec & 0xC000 == 0xC000 else 2),
        packets={"rssi_dbm": rssi_dbm, "sequence": sequence},
        info={
            "bandwidth_mhz": _WIDTHS_MHZ.get((first.chanspec >> 11) & 7, bins * 5 // 16),
            "format": "VHT" if bins == 256 else "HT",
            "device": f"BCM{chip}",
            "channel": number,
        },
    )


def _times(packets: list[_Packet]) -> tuple[list[int], int]:
    """Row of each packet: those of one frame, told by its sequence number, share one."""
    rows, seen, row = [], set(), -1
    before = None
    for packet in packets:
        place = packet.core, packet.stream
        if packet.sequence != before or place in seen:
            row, seen, before = row + 1, set(), packet.sequence
        seen.add(place)
        rows.append(row)
    return rows, row + 1


def _used(bins: int) -> np.ndarray:
    """Subcarriers that carry data or pilots in a packet that fills the band."""
    used = occupied("VHT" if bins == 256 else "HT", bins * 5 // 16)
    assert used is not None
    return used


def _chip(number: int, words: UInt32[np.ndarray, "packet bin"]) -> str:
    """Chip of a capture: by its number, else by the exponents that floats share.

    Channels of 16-bit integers have words whose low bits are as random as any; those of floats
    hold a signed exponent that hardly changes from bin to bin.
    """
    if number in _CHIPS:
        return _CHIPS[number]
    for chip, (_, exponent) in _FLOATS.items():
        low = (words & ((1 << exponent) - 1)).astype(np.int64)
        low -= (low >> (exponent - 1)) << exponent
        if np.abs(np.diff(low, axis=1)).mean() < 0.05 * (1 << exponent):
            return chip
    return "43455c0"


def unpack_words(
    words: UInt32[np.ndarray, "packet bin"], chip: str
) -> Complex64[np.ndarray, "packet bin"]:
    """Channels in FFT order of one 32-bit word per bin.

    Integers: low half real, high half imaginary. Floats of m mantissa and e exponent bits: from
    the top sign and m − 1 … bits of the real, the same of the imaginary part, then a signed
    exponent; value = mantissa · 2^exponent.
    """
    if chip not in _FLOATS:
        parts = words.view(np.int16).astype(np.float32)
        return parts.view(np.complex64)
    mantissa, exponent = _FLOATS[chip]
    power = (words & ((1 << exponent) - 1)).astype(np.int64)
    power -= (power >> (exponent - 1)) << exponent
    mask = (1 << (mantissa - 1)) - 1
    wide = words.astype(np.int64)
    real = (wide >> (exponent + mantissa)) & mask
    imaginary = (wide >> exponent) & mask
    real = np.where((wide >> (exponent + 2 * mantissa - 1)) & 1, -real, real)
    imaginary = np.where((wide >> (exponent + mantissa - 1)) & 1, -imaginary, imaginary)
    return ((real + 1j * imaginary) * np.exp2(power)).astype(np.complex64)
