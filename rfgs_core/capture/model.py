# SPDX-License-Identifier: Apache-2.0
"""What every reader of captures gives: one canonical array with its axes, mask and metadata."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.errors import RfgsFormatError

#: What the last axis of a capture runs over: subcarriers [Hz from the centre], delays [s] or
#: ranges of an out-and-back path [m], or directions of a picture (row · columns + column).
Axis = Literal["subcarrier", "delay", "range", "direction"]

#: Decoded values of one file, at most; half a GiB of complex64.
MOST_VALUES = 2**26
#: Memory that reading one file takes at most: its bytes, its values and mask, copies on the way.
MOST_MEMORY_BYTES = 4 * 2**30


@dataclass(frozen=True)
class Capture:
    """Packets of one format from one radio; devices and their antennas are axes of their own."""

    source: str
    """Name of the reader."""
    values: Complex64[np.ndarray, "time device rx tx bin"]
    """Channels in the radio's own unit; 0 where nothing was received."""
    valid: Bool[np.ndarray, "time device rx tx bin"]
    """Where `values` was measured: neither missing nor a pilot or null that was filled."""
    time_s: Float64[np.ndarray, "time"]
    """Time of each packet since the first one [s], never descending."""
    axis: Axis
    """What `bins` are."""
    bins: Float64[np.ndarray, "bin"]
    """Offset from the centre [Hz], delay [s] or range [m] of each bin, ascending."""
    index: Int64[np.ndarray, "bin"]
    """Subcarrier number as the standard counts (0 is the centre), or number of the bin."""
    centre_hz: float | None = None
    """Centre frequency [Hz]; None where the file does not tell."""
    packets: dict[str, np.ndarray] = field(default_factory=dict)
    """What was reported beside each packet (rssi_dbm, agc_db, sequence, …), first axis time."""
    info: dict[str, Any] = field(default_factory=dict)
    """What holds for all packets: bandwidth, packet format, settings of the radio."""
    tx_xyz: Float64[np.ndarray, "time 3"] | None = None
    """Place of the transmitter at each packet [m], where the file tells."""
    rx_xyz: Float64[np.ndarray, "time 3"] | None = None
    """Place of the receiver at each packet [m], where the file tells."""

    def __post_init__(self) -> None:
        bins = len(self.bins)
        assert self.values.ndim == 5 and self.values.dtype == np.complex64, self.values.shape
        assert self.values.shape == self.valid.shape and self.values.shape[-1] == bins
        assert len(self.time_s) == len(self.values) and len(self.index) == bins

    def __len__(self) -> int:
        return len(self.values)

    @property
    def rate_hz(self) -> float:
        """Median packet rate [Hz]; 0 of a single packet or of packets without times."""
        steps = np.diff(self.time_s)
        return float(1.0 / np.median(steps)) if len(steps) and np.median(steps) > 0 else 0.0

    @property
    def freq_hz(self) -> Float64[np.ndarray, "bin"]:
        """Absolute frequency of each subcarrier [Hz].

        Raises:
            RfgsFormatError: The file does not tell its centre, or the axis is another one.
        """
        if self.axis != "subcarrier" or self.centre_hz is None:
            raise RfgsFormatError(
                f"{self.source}: this capture tells no frequencies; give centre_hz in --layout"
            )
        return self.centre_hz + self.bins

    def select(self, which: slice | np.ndarray) -> Capture:
        """The same capture with some of its packets."""
        return replace(
            self,
            values=self.values[which],
            valid=self.valid[which],
            time_s=self.time_s[which],
            packets={name: value[which] for name, value in self.packets.items()},
            tx_xyz=None if self.tx_xyz is None else self.tx_xyz[which],
            rx_xyz=None if self.rx_xyz is None else self.rx_xyz[which],
        )


@dataclass(frozen=True)
class Reading:
    """What one file holds: a capture for each packet format, and what was wrong with the file."""

    path: Path
    """The file or folder."""
    source: str
    """Name of the reader."""
    captures: list[Capture]
    """One for each packet format, shape and band in the file; the one with most packets first."""
    warnings: list[str] = field(default_factory=list)
    """One sentence for each kind of damage, with its count."""

    @property
    def largest(self) -> Capture:
        """The capture with most packets."""
        return self.captures[0]


def reading(path: Path, source: str, captures: list[Capture], damage: dict[str, int]) -> Reading:
    """Puts a reader's result together.

    Args:
        path: The file.
        source: Name of the reader.
        captures: What was decoded.
        damage: Kind of damage, in words → how often it was met.

    Raises:
        RfgsFormatError: Nothing was decoded; the message says what was met instead.
    """
    warnings = [f"{count} {kind}" for kind, count in damage.items() if count]
    captures = [capture for capture in captures if len(capture)]
    if not captures:
        read = "; ".join(warnings) or "none at all"
        raise RfgsFormatError(f"{path}: expected {source} records, found {read}; check the file")
    captures.sort(key=len, reverse=True)
    return Reading(path, source, captures, warnings)
