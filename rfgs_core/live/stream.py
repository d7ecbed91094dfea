# SPDX-License-Identifier: Apache-2.0
"""A stream of packets from several radios, one UDP port for each that receives."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex64, Int64

from rfgs_core.capture.channels import Channels, channels_of
from rfgs_core.capture.layout_file import CaptureLayout
from rfgs_core.capture.prepare import radio_of
from rfgs_core.capture.prepared import bounds_around
from rfgs_core.errors import RfgsError
from rfgs_core.live.counts import Counts
from rfgs_core.live.ears import Datagram, Ears
from rfgs_core.live.phases import Bins, OwnUnits
from rfgs_core.live.records import READERS, Decoded, Decoder, Kind, Packets, decode, kind_of
from rfgs_core.live.setting import Heard, Reported, Setting, every_nth
from rfgs_core.radio import layout

#: Packets of each radio that its format is told from.
_FIRST = 8
#: How often it is looked whether they have come [s].
_LOOK_S = 0.02


@dataclass(frozen=True)
class StreamOptions:
    """How packets are heard."""

    host: str = "127.0.0.1"
    """Address to listen at."""
    port: int = 5500
    """UDP port of the first radio that receives; the others follow in the layout's order."""
    format: Packets = "feitcsi"
    """What the datagrams hold, one record each."""
    most_per_s: float = 5000.0
    """Packets of a radio in a second, at most; more are counted and left out."""
    wait_s: float = 60.0
    """How long to wait for the first packets of every radio [s]."""


class Stream:
    """Packets of several radios as they arrive."""

    def __init__(
        self, given: CaptureLayout, options: StreamOptions, reported: Reported = "complex"
    ) -> None:
        """Listens, and waits until every radio was heard.

        Args:
            given: Where the radios stand; file names in it are not read.
            options: How to listen.
            reported: What of the packets is trusted.

        Raises:
            RfgsError: A port is taken, a radio stays silent, or radios send different formats.
        """
        self.given, self._options = given, options
        self._reader = READERS[options.format]
        receivers = given.receivers
        ports = [options.port + row if options.port else 0 for row in range(len(receivers))]
        self._ears = Ears(options.host, ports, self._reader.is_record, options.most_per_s)
        self._early: list[list[Datagram]] = [[] for _ in ports]
        try:
            first = self._first_packets()
            self.setting, place = _setting(given, first, reported)
        except BaseException:
            self._ears.close()
            raise
        kind = kind_of(first[0].capture)
        self._decoders = [self._decoder(row, kind, place) for row in range(len(receivers))]

    @property
    def ports(self) -> list[int]:
        """UDP port of each radio that receives."""
        return self._ears.ports

    @property
    def counts(self) -> list[Counts]:
        """What became of the packets of each radio that receives."""
        return self._ears.counts

    @property
    def ended(self) -> bool:
        """A stream does not end by itself."""
        return False

    def take(self, now_s: float) -> list[Heard]:
        """Packets that came since the last call."""
        heard = []
        for row, (device, decoder) in enumerate(
            zip(self.given.receivers, self._decoders, strict=True)
        ):
            early, self._early[row] = self._early[row], []
            found = decoder(early + self._ears.fetch(row))
            if found is not None:
                heard.append(Heard(device, found[0], found[1], found[2]))
        return heard

    def close(self) -> None:
        """Stops listening."""
        self._ears.close()

    def _decoder(self, row: int, kind: Kind, place: _Place) -> Decoder:
        in_units = OwnUnits(self.setting, self.given.receivers[row], place.bins)
        return Decoder(
            self._reader,
            kind,
            self.counts[row],
            lambda capture: place(in_units(capture.values[:, 0])),
        )

    def _first_packets(self) -> list[Decoded]:
        """Packets of the commonest kind, of each radio."""
        waiting = self._early
        end_s = time.monotonic() + self._options.wait_s
        while min(map(len, waiting)) < _FIRST:
            if time.monotonic() > end_s:
                raise self._silent(waiting)
            time.sleep(_LOOK_S)
            # Enough is enough: what else they send waits where memory is bounded.
            for row, rows in enumerate(waiting):
                if len(rows) < _FIRST:
                    rows += self._ears.fetch(row)
        found = []
        for row, rows in enumerate(waiting):
            decoded = decode(self._reader, rows, Counts())
            if not decoded:
                raise self._silent([[] if n == row else r for n, r in enumerate(waiting)])
            found.append(max(_by_kind(decoded), key=lambda each: len(each.capture)))
        return found

    def _silent(self, waiting: list[list[Datagram]]) -> RfgsError:
        row = min(range(len(waiting)), key=lambda each: len(waiting[each]))
        device = self.given.devices[self.given.receivers[row]].name
        return RfgsError(
            f"device {device!r}: expected {self._options.format} packets at UDP port "
            f"{self._ears.ports[row]} within {self._options.wait_s:g} s, found "
            f"{self.counts[row]}; check --format, --port and what the radio sends to"
        )


def _by_kind(decoded: list[Decoded]) -> list[Decoded]:
    """The kind that most packets are of, first packet first."""
    number: Counter[Kind] = Counter()
    for each in decoded:
        number[kind_of(each.capture)] += len(each.capture)
    common = number.most_common(1)[0][0]
    return [each for each in decoded if kind_of(each.capture) == common]


@dataclass(frozen=True)
class _Place:
    """Where bins that are followed belong among the setting's subcarriers."""

    bins: Bins
    rows: Int64[np.ndarray, "followed"]
    count: int

    def __call__(
        self, values: Complex64[np.ndarray, "packet rx tx followed"]
    ) -> Complex64[np.ndarray, "packet rx tx subcarrier"]:
        found = np.zeros((*values.shape[:-1], self.count), np.complex64)
        found[..., self.rows] = values
        return found


def _setting(
    given: CaptureLayout, first: list[Decoded], reported: Reported
) -> tuple[Setting, _Place]:
    """What the first packets tell of the radios.

    Raises:
        RfgsError: Radios send different formats.
    """
    kinds = [kind_of(each.capture) for each in first]
    for row, kind in enumerate(kinds):
        if kind != kinds[0]:
            one, two = given.receivers[0], given.receivers[row]
            raise RfgsError(
                f"device {given.devices[two].name!r} sends {kind}, {given.devices[one].name!r} "
                f"{kinds[0]}; expected packets of one kind, follow the others in a stream of theirs"
            )
    channels = channels_of(first[0].capture, 0, given.centre_hz)
    used = np.arange(channels.values.shape[1])
    radio = radio_of(given, channels, used)
    kept, place = _kept(channels)
    bounds = given.bounds_m
    if bounds is None:
        bounds = bounds_around([device.position_m for device in given.devices])
    setting = Setting(
        name=given.name,
        devices=list(given.devices),
        layout=layout(radio, list(given.devices)),
        freq_hz=channels.freq_hz[kept],
        subcarriers=channels.measured[kept],
        bounds_m=np.array(bounds, np.float64),
        reported=reported,
    )
    return setting, place


def _kept(channels: Channels) -> tuple[Int64[np.ndarray, "subcarrier"], _Place]:
    """Subcarriers that are followed, and where packets hold them."""
    kept = every_nth(len(channels.measured))
    place = channels.place
    followed = np.flatnonzero(np.isin(place, kept))
    bins = Bins(channels.freq_hz[place], place, channels.measured[place], followed)
    return kept, _Place(bins, np.searchsorted(kept, place[followed]), len(kept))
