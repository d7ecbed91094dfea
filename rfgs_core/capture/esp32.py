# SPDX-License-Identifier: Apache-2.0
"""ESP32 captures, `.csv`: ESP32-CSI-Tool (Hernandez and Bulut 2020) and Espressif's esp-csi.

One line per packet: fields, then signed bytes, imaginary part before real. ESP32-CSI-Tool writes
them apart by spaces, esp-csi apart by commas in quotes, with the names of the fields in its first
line. The bytes are the packet's training fields (`esp32_fields` tells which subcarrier is where).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rfgs_core.capture.esp32_fields import Kind, carries, field_of
from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many, unwrapped_s
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.wifi_grid import SPACING_HZ, channel_hz

NAME = "esp32"
TITLE = "ESP32, ESP32-CSI-Tool and esp-csi"
SUFFIXES = (".csv", ".txt")

_TOOL_FIELDS = (
    *("type", "role", "mac", "rssi", "rate", "sig_mode", "mcs", "bandwidth", "smoothing"),
    *("not_sounding", "aggregation", "stbc", "fec_coding", "sgi", "noise_floor", "ampdu_cnt"),
    *("channel", "secondary_channel", "local_timestamp", "ant", "sig_len", "rx_state"),
    *("real_time_set", "real_timestamp", "len"),
)
_ESP_FIELDS = (
    *("type", "id", "mac", "rssi", "rate", "sig_mode", "mcs", "bandwidth", "smoothing"),
    *("not_sounding", "aggregation", "stbc", "fec_coding", "sgi", "noise_floor", "ampdu_cnt"),
    *("channel", "secondary_channel", "local_timestamp", "ant", "sig_len", "rx_state", "len"),
    "first_word",
)
#: Of chips since the ESP32-C5 and C6, which report fewer fields.
_SHORT_FIELDS = (
    *("type", "id", "mac", "rssi", "rate", "noise_floor", "fft_gain", "agc_gain", "channel"),
    *("local_timestamp", "sig_len", "rx_state", "len", "first_word"),
)
_LINE = re.compile(rb'^(CSI_DATA|type),(.*?),\s*"?\[([^\]\n"]*)\]?"?\s*$', re.MULTILINE)
_START = re.compile(rb"^\s*(type,|CSI_DATA,)", re.MULTILINE)
_LONGEST_CHANNEL = 1024


#: Fields that are kept of each line.
_KEPT = (
    *("channel", "secondary_channel", "sig_mode", "bandwidth", "stbc"),
    *("rssi", "noise_floor", "local_timestamp", "agc_gain", "fft_gain"),
)


@dataclass(frozen=True)
class _Row:
    """One line: kept fields in the order of `_KEPT`, None where there is none, and its bytes."""

    fields: tuple[int | None, ...]
    numbers: np.ndarray

    @property
    def kind(self) -> Kind:
        """What decides where each byte belongs."""
        told = [value or 0 for value in self.fields[:5]]
        return Kind(*told, short=self.fields[2] is None, count=len(self.numbers) // 2)


def _column(rows: list[_Row], name: str) -> np.ndarray:
    """A field of all lines, 0 where it is missing."""
    place = _KEPT.index(name)
    return np.array([row.fields[place] or 0 for row in rows], np.int64)


def looks_like(head: bytes, _path: Path) -> bool:
    """Whether a file begins with a line of either tool."""
    return bool(_START.match(head)) and (b"CSI_DATA" in head or b"local_timestamp" in head)


def read(path: Path) -> Reading:
    """Reads a capture.

    Returns:
        Channels (time, 1, 1, 1, subcarrier) as the chip's signed bytes, of the HT or HE training
        field where the packet has one, else of the legacy one; one capture for each channel, width
        and length. Nulls and the first two samples, which the chip spoils, are not `valid`.
        `packets` holds rssi_dbm, noise_dbm and clock_us, and agc_gain and fft_gain where reported.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is empty, too large or holds no channel.
    """
    return decode(path, read_bytes(path))


def is_record(data: bytes) -> bool:
    """Whether bytes are one whole line of a packet, with or without its end."""
    line = data.rstrip(b"\r\n")
    return line.startswith(b"CSI_DATA,") and line.rstrip(b'"').endswith(b"]") and b"\n" not in line


def decode(path: Path, data: bytes) -> Reading:
    """Reads lines that are at hand; see `read`.

    Args:
        path: Where they are from, for messages.
        data: The lines.

    Raises:
        RfgsFormatError: They hold no channel, or too many.
    """
    damage = {"lines that hold no whole channel": 0}
    groups: dict[Kind, list[_Row]] = {}
    for row in _rows(data, damage):
        groups.setdefault(row.kind, []).append(row)
    captures = []
    for kind, rows in groups.items():
        capture = _capture(path, kind, rows)
        if capture is None:
            damage["lines that hold no whole channel"] += len(rows)
        else:
            captures.append(capture)
    return reading(path, NAME, captures, damage)


def _rows(data: bytes, damage: dict[str, int]) -> list[_Row]:
    rows, names = [], None
    for line in data.splitlines():
        if line.startswith(b"type,"):
            names = tuple(line.decode("ascii", "replace").strip().split(","))[:-1]
            continue
        if not line.strip():
            continue
        row = _row(line, names)
        if row is None:
            damage["lines that hold no whole channel"] += 1
        else:
            rows.append(row)
    return rows


def _row(line: bytes, names: tuple[str, ...] | None) -> _Row | None:
    match = _LINE.match(line)
    if match is None or not line.rstrip().rstrip(b'"').endswith(b"]"):
        return None
    fields = ["CSI_DATA", *match[2].decode("ascii", "replace").split(",")]
    fitting = [given for given in (names, _TOOL_FIELDS, _ESP_FIELDS, _SHORT_FIELDS) if given]
    chosen = next((given for given in fitting if len(given) == len(fields)), None)
    try:
        numbers = np.array(match[3].replace(b",", b" ").split(), dtype=np.int64)
    except (ValueError, OverflowError):
        return None
    whole = len(numbers) % 2 == 0 and 4 <= len(numbers) <= 2 * _LONGEST_CHANNEL
    if chosen is None or not whole or np.abs(numbers).max() > 128:
        return None
    given = dict(zip(chosen, fields, strict=True))
    kept = tuple(_whole(given[name]) if name in given else None for name in _KEPT)
    return _Row(kept, numbers.astype(np.int8 if numbers.max() < 128 else np.int16))


def _whole(text: str) -> int:
    """A whole number of at most 63 bits; 0 where the text is none."""
    try:
        number = int(float(text))
    except (ValueError, OverflowError):
        return 0
    return number if abs(number) < 1 << 62 else 0


def _capture(path: Path, kind: Kind, rows: list[_Row]) -> Capture | None:
    refuse_too_many(path, len(rows) * kind.count)
    numbers = np.stack([row.numbers for row in rows]).astype(np.float32)
    samples = (numbers[:, 1::2] + 1j * numbers[:, ::2]).astype(np.complex64)
    field = field_of(kind, samples)
    if field is None:
        return None
    order = np.argsort(field.index, kind="stable")
    index, usable = field.index[order], carries(field)[order]
    values = np.where(usable, samples[:, field.part][:, order], 0)[:, None, None, None]
    stamps = _column(rows, "local_timestamp")
    packets = {
        "rssi_dbm": _column(rows, "rssi").astype(np.float64),
        "noise_dbm": _column(rows, "noise_floor").astype(np.float64),
        "clock_us": stamps,
    }
    for name in ("agc_gain", "fft_gain"):
        if rows[0].fields[_KEPT.index(name)] is not None:
            packets[name] = _column(rows, name)
    return Capture(
        source=NAME,
        values=values,
        valid=np.broadcast_to(usable, values.shape).copy(),
        time_s=unwrapped_s(stamps, 32, 1e-6),
        axis="subcarrier",
        bins=index * SPACING_HZ[field.form],
        index=index,
        centre_hz=_centre_hz(kind, field),
        packets=packets,
        info={"bandwidth_mhz": 40 if field.wide else 20, "format": field.form},
    )


def _centre_hz(kind: Kind, field: Field) -> float | None:
    """Where subcarriers are counted from [Hz]; None where nobody says."""
    centre = channel_hz(kind.channel)
    if kind.short and field.wide:
        return None  # Whether the second channel lies above or below is not reported.
    if centre is not None and kind.second in (1, 2):
        # Numbers of a 40 MHz channel count from its middle, 10 MHz from the primary one.
        centre += 10e6 if kind.second == 1 else -10e6
    return centre
