# SPDX-License-Identifier: Apache-2.0
"""What became of every packet, and how long it took."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float64, Int64

#: Width of the bins that times are counted in, and the longest that is told apart [s].
_BIN_S, _LONGEST_S = 1e-4, 20.0


@dataclass
class Counts:
    """Packets of one device: how many came, and what became of them."""

    received: int = 0
    """Datagrams that reached the program."""
    used: int = 0
    """Packets that went into a window."""
    malformed: int = 0
    """Datagrams that are no whole record, or do not decode."""
    too_large: int = 0
    """Datagrams above the largest size."""
    too_many: int = 0
    """Datagrams above the highest rate."""
    other_format: int = 0
    """Packets of another format, width or number of antennas than the first ones."""
    duplicate: int = 0
    """Packets that had come before."""
    late: int = 0
    """Packets of a window that was closed; used, they teach the background alone."""
    too_late: int = 0
    """Packets that came so late that they are left out."""
    pushed_out: int = 0
    """Packets that newer ones pushed out of a full queue."""
    before_us: int = 0
    """Packets that the system dropped before the program read them."""

    @property
    def lost_inside(self) -> int:
        """Good packets that the program did not use for want of time or room."""
        return self.pushed_out + self.too_late

    def plus(self, other: Counts) -> Counts:
        """Both added up."""
        return Counts(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    def __str__(self) -> str:
        """Everything that happened, in words."""
        named = {f.name.replace("_", " "): getattr(self, f.name) for f in fields(self)}
        named["dropped before the program"] = named.pop("before us")
        shown = [f"{count} {name}" for name, count in named.items() if count]
        return ", ".join(shown) or "nothing received"


class Times:
    """Times of any number of packets in bounded memory, to a tenth of a millisecond."""

    def __init__(self) -> None:
        """None yet."""
        self._bins: Int64[np.ndarray, "bin"] = np.zeros(int(_LONGEST_S / _BIN_S) + 1, np.int64)

    def add(self, times_s: Float64[np.ndarray, "n"]) -> None:
        """Counts some times [s]."""
        place = np.clip(times_s / _BIN_S, 0, len(self._bins) - 1).astype(np.int64)
        np.add.at(self._bins, place, 1)

    def __len__(self) -> int:
        return int(self._bins.sum())

    def percentile_s(self, share: float) -> float:
        """The time that a share of all [%] does not exceed [s]; NaN of none."""
        if not len(self):
            return float("nan")
        wanted = share / 100.0 * len(self)
        return float(np.searchsorted(np.cumsum(self._bins), wanted) + 1) * _BIN_S
