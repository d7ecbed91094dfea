# SPDX-License-Identifier: Apache-2.0
"""Clocks of radios, told by when their packets arrive."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Bool, Float64, Int64

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
