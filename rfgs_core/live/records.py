# SPDX-License-Identifier: Apache-2.0
"""Datagrams of one radio become channels: decoded many at once by the reader of their format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from jaxtyping import Complex64, Float64, Int64

from rfgs_core.capture import esp32, feitcsi, picoscenes
from rfgs_core.capture.model import Capture, Reading
from rfgs_core.errors import RfgsFormatError
from rfgs_core.live.clocks import DeviceClock
from rfgs_core.live.counts import Counts
from rfgs_core.live.ears import Datagram

#: Formats that are heard, by the names of their readers.
Packets = Literal["feitcsi", "picoscenes", "esp32"]


class RecordReader(Protocol):
    """What a reader of captures offers for records that are at hand."""

    def is_record(self, data: bytes) -> bool:
        """Whether bytes are one whole record."""
        ...

    def decode(self, path: Path, data: bytes) -> Reading:
        """Decodes records one behind the other."""
        ...


READERS: dict[Packets, RecordReader] = {
    "feitcsi": feitcsi,  # type: ignore[dict-item]
    "picoscenes": picoscenes,  # type: ignore[dict-item]
    "esp32": esp32,  # type: ignore[dict-item]
}
#: Bits of the clock that packets carry.
_CLOCK_BITS = 32

#: What packets of one stream share: format, width, antennas and subcarriers.
Kind = tuple[object, ...]


def kind_of(capture: Capture) -> Kind:
    """What makes packets of one kind."""
    centre = capture.centre_hz
    return (*capture.info.values(), centre, *capture.values.shape[1:])


@dataclass(frozen=True)
class Decoded:
    """Packets of one kind, in the order of their arrival."""

    capture: Capture
    """Channels; `time_s` counts from the first of them."""
    arrived_s: Float64[np.ndarray, "packet"]
    """When each arrived [s]."""


def decode(reader: RecordReader, datagrams: list[Datagram], counts: Counts) -> list[Decoded]:
    """Decodes datagrams; what does not decode is counted.

    Datagrams of one length are mostly packets of one kind, which a reader decodes at once; where
    one of them is another, halves are tried until it stands alone.
    """
    groups: dict[int, list[Datagram]] = {}
    for datagram in datagrams:
        length = 0 if reader is READERS["esp32"] else len(datagram[1])
        groups.setdefault(length, []).append(datagram)
    found = []
    left = [*groups.values()]
    while left:
        group = left.pop()
        whole = _together(reader, group)
        if whole is not None:
            found.append(whole)
        elif len(group) == 1:
            counts.malformed += 1
        else:
            half = len(group) // 2
            left += [group[half:], group[:half]]
    return found


def _together(reader: RecordReader, datagrams: list[Datagram]) -> Decoded | None:
    """Decodes datagrams of one kind; None where not all of them are."""
    data = b"".join(record.rstrip(b"\r\n") + b"\n" for _, record in datagrams)
    if reader is not READERS["esp32"]:
        data = b"".join(record for _, record in datagrams)
    try:
        reading = reader.decode(Path("packet"), data)
    except RfgsFormatError:
        return None
    if len(reading.largest) != len(datagrams):
        return None
    return Decoded(reading.largest, np.array([arrived_s for arrived_s, _ in datagrams]))


class Decoder:
    """Packets of one radio from datagrams to channels on our clock."""

    def __init__(
        self,
        reader: RecordReader,
        kind: Kind,
        counts: Counts,
        channels: Callable[[Capture], Complex64[np.ndarray, "packet rx tx subcarrier"]],
    ) -> None:
        """A decoder of one kind of packets.

        Args:
            reader: Their format.
            kind: What the first ones were; others are counted and left out.
            counts: Where to count.
            channels: Puts values on the subcarriers of the setting.
        """
        self._reader, self._kind, self._counts = reader, kind, counts
        self._channels, self._clock = channels, DeviceClock(_CLOCK_BITS)

    def __call__(
        self, datagrams: list[Datagram]
    ) -> (
        tuple[
            Float64[np.ndarray, "packet"],
            Float64[np.ndarray, "packet"],
            Complex64[np.ndarray, "packet rx tx subcarrier"],
        ]
        | None
    ):
        """Times [s], arrivals [s] and channels of new packets; None where there are none."""
        rows = []
        for decoded in decode(self._reader, datagrams, self._counts):
            if kind_of(decoded.capture) == self._kind:
                rows.append(decoded)
            else:
                self._counts.other_format += len(decoded.capture)
        if not rows:
            return None
        ticks: Int64[np.ndarray, "packet"] = np.concatenate(
            [row.capture.packets["clock_us"].astype(np.int64) for row in rows]
        )
        arrived_s = np.concatenate([row.arrived_s for row in rows])
        values = np.concatenate([self._channels(row.capture) for row in rows])
        time_s, new = self._clock.times_s(ticks & 0xFFFF_FFFF, arrived_s)
        self._counts.duplicate += int((~new).sum())
        return (time_s[new], arrived_s[new], values[new]) if new.any() else None
