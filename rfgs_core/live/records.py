# SPDX-License-Identifier: Apache-2.0
"""Datagrams of one radio become channels: decoded many at once by the reader of their format."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.capture import esp32, feitcsi, picoscenes
from rfgs_core.capture.model import Capture, Reading
from rfgs_core.errors import RfgsFormatError
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


#: Ticks of the packets that a new one may repeat.
_REMEMBERED = 4096
#: How fast a radio's clock may run against ours.
_DRIFT = 200e-6
#: A clock that is further off than this was set anew [s].
_JUMP_S = 0.1


class DeviceClock:
    """Times on our clock of a device that counts microseconds.

    A packet arrives some time after it was received, never before: the least difference of
    arrival and device clock is the offset of the clocks (Cristian, Distributed Computing 3, 1989,
    taken one way). It may grow by `_DRIFT`, so that clocks that run apart are followed.
    """

    def __init__(self, bits: int) -> None:
        """A clock that wraps at 2^bits microseconds."""
        self._period = 1 << bits
        self._last: int | None = None
        self._elapsed_s = 0.0
        self._offset_s = 0.0
        self._seen: deque[int] = deque(maxlen=_REMEMBERED)
        self._known: set[int] = set()

    def times_s(
        self, ticks_us: Int64[np.ndarray, "n"], arrived_s: Float64[np.ndarray, "n"]
    ) -> tuple[Float64[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
        """Times of packets on our clock, and whether each is new.

        Args:
            ticks_us: The device's clock at each packet [µs]; one that stands at zero tells nothing,
                and arrival counts instead.
            arrived_s: When each arrived, on our clock [s].

        Returns:
            Times [s], never after arrival, and False for packets that came before.
        """
        if not ticks_us.any():
            return arrived_s.copy(), np.ones(len(ticks_us), bool)
        elapsed_s = self._unwrapped_s(ticks_us)
        found = float((arrived_s - elapsed_s).min())
        drift_s = _DRIFT * max(float(elapsed_s.max()) - self._elapsed_s, 0.0)
        if self._last is None or abs(found - self._offset_s) > _JUMP_S:
            self._offset_s = found
        else:
            self._offset_s = min(found, self._offset_s + drift_s)
        self._last = int(ticks_us[np.argmax(elapsed_s)])
        self._elapsed_s = float(elapsed_s.max())
        return np.minimum(elapsed_s + self._offset_s, arrived_s), self._new(ticks_us)

    def _unwrapped_s(self, ticks_us: Int64[np.ndarray, "n"]) -> Float64[np.ndarray, "n"]:
        """Seconds on a count that does not wrap; packets out of order have their own time."""
        last = int(ticks_us[0]) if self._last is None else self._last
        half = self._period // 2
        away = (ticks_us - last + half) % self._period - half
        return self._elapsed_s + 1e-6 * away

    def _new(self, ticks_us: Int64[np.ndarray, "n"]) -> Bool[np.ndarray, "n"]:
        new = np.zeros(len(ticks_us), bool)
        for row, tick in enumerate(ticks_us.tolist()):
            if tick in self._known:
                continue
            new[row] = True
            if len(self._seen) == _REMEMBERED:
                self._known.discard(self._seen[0])
            self._seen.append(tick)
            self._known.add(tick)
        return new
