# SPDX-License-Identifier: Apache-2.0
"""Packets of several radios, cut into windows of one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Complex64, Float64

from rfgs_core.live.counts import Counts
from rfgs_core.live.setting import Heard, Setting

#: Packets that come later than this after their window was closed are left out [s].
LATEST_S = 1.0


@dataclass(frozen=True)
class Window:
    """What all radios reported until the end of a window."""

    end_s: float
    """When it ended [s]."""
    csi: Complex64[np.ndarray, "tx rx subcarrier"]
    """Channel at its end; of powers the RMS amplitude. Zero where nothing was heard."""
    mean: Complex64[np.ndarray, "tx rx subcarrier"]
    """The same over all of its packets."""
    links: Bool[np.ndarray, "tx rx"]
    """Links that were heard."""
    arrived_s: Float64[np.ndarray, "packet"]
    """When its packets arrived [s]."""


class Windows:
    """Packets that wait for their window."""

    def __init__(
        self, setting: Setting, counts: Mapping[int, Counts], step_s: float, span_s: float
    ) -> None:
        """None yet; the first packet begins the first window.

        Args:
            setting: The radios.
            counts: Where to count packets, by device.
            step_s: From the end of a window to that of the next one [s].
            span_s: Packets of so long before the end are put together: people hardly move within,
                and noise falls [s].
        """
        self._setting, self._counts = setting, counts
        self._step_s, self._span_s = step_s, span_s
        self._waiting: dict[int, list[Heard]] = {device: [] for device in setting.receivers}
        self._closed_s: float | None = None

    def add(self, heard: list[Heard]) -> None:
        """Takes packets; those of a window that is closed are late, and part of the next one."""
        if self._closed_s is None:
            self._closed_s = min((float(e.time_s.min()) for e in heard), default=None)
            if self._closed_s is None:
                return
            self._closed_s -= 1e-6
        for each in heard:
            in_time = each.time_s > self._closed_s - LATEST_S
            counts = self._counts[each.device]
            counts.too_late += int((~in_time).sum())
            counts.late += int((in_time & (each.time_s <= self._closed_s)).sum())
            self._waiting[each.device].append(_rows(each, in_time))

    def due(self, until_s: float) -> float | None:
        """End of the last whole window before a time [s]; None where there is none."""
        if self._closed_s is None:
            return None
        steps = int((until_s - self._closed_s) / self._step_s)
        return self._closed_s + steps * self._step_s if steps > 0 else None

    def close(self, end_s: float) -> Window:
        """Ends a window; windows that were left out before it are part of it."""
        layout, bins = self._setting.layout, len(self._setting.freq_hz)
        csi = np.zeros((*layout.measured.shape, bins), np.complex64)
        mean, links, arrived = np.zeros_like(csi), np.zeros(layout.measured.shape, bool), []
        for device in self._setting.receivers:
            own = self._fetch(device, end_s)
            if own is None:
                continue
            self._counts[device].used += len(own.time_s)
            arrived.append(own.arrived_s)
            tx, rx = self._setting.block(device)
            place = np.ix_(tx, rx)
            near = own.time_s > min(end_s - self._span_s, float(own.time_s.max()) - 1e-9)
            csi[place] = self._together(own.values[near])
            mean[place] = self._together(own.values)
            links[place] = layout.measured[place]
        self._closed_s = end_s
        return Window(end_s, csi, mean, links, np.concatenate([np.zeros(0), *arrived]))

    def _fetch(self, device: int, end_s: float) -> Heard | None:
        """Packets of a device until a time; later ones stay."""
        waiting = self._waiting[device]
        if not waiting:
            return None
        whole = replace(
            waiting[0],
            time_s=np.concatenate([each.time_s for each in waiting]),
            arrived_s=np.concatenate([each.arrived_s for each in waiting]),
            values=np.concatenate([each.values for each in waiting]),
        )
        now = whole.time_s <= end_s
        self._waiting[device] = [] if now.all() else [_rows(whole, ~now)]
        return _rows(whole, now) if now.any() else None

    def _together(
        self, values: Complex64[np.ndarray, "packet rx tx subcarrier"]
    ) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Mean of packets whose phases agree, root of the mean power of others."""
        if self._setting.reported == "power":
            values = np.sqrt(np.mean(values.real**2 + values.imag**2, axis=0)).astype(np.complex64)
        else:
            values = values.mean(axis=0)
        return np.swapaxes(values, 0, 1)


def _rows(heard: Heard, which: Bool[np.ndarray, "packet"]) -> Heard:
    """Some of the packets."""
    return replace(
        heard,
        time_s=heard.time_s[which],
        arrived_s=heard.arrived_s[which],
        values=heard.values[which],
    )
