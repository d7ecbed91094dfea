# SPDX-License-Identifier: Apache-2.0
"""What radios report of a channel: itself, powers, or what links of a packet say of each other."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Bool, Complex64, Float32, Float64

from rfgs_core.measure.packets import change_of_packets
from rfgs_core.measure.phase_free import (
    delay_amplitude,
    direct_amplitude,
    direct_wave,
    hologram,
)
from rfgs_core.measure.relative import Relative, on_direct_paths, relative_change
from rfgs_core.radio import Layout
from rfgs_core.settings import Observe

#: What a radio reports of a channel; the last axis is subcarrier or delay.
Reported = Complex64[np.ndarray, "tx rx entry"] | Float32[np.ndarray, "tx rx entry"]


class Visible(NamedTuple):
    """What of a radio training may use."""

    links: Bool[np.ndarray, "tx rx"]
    """Visible links."""
    subcarriers: Bool[np.ndarray, "subcarrier"]
    """Visible subcarriers."""
    layout: Layout
    """Antenna elements."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Subcarrier frequencies [Hz]."""

    @property
    def entries(self) -> np.ndarray:
        """Visible entries of the channel, bool, shape (tx, rx, subcarrier)."""
        return self.links[:, :, None] & self.subcarriers


class Change(NamedTuple):
    """What a frame changes of the empty room; see `Observations` for each part."""

    delta: np.ndarray
    static: np.ndarray
    delay_change: Float32[np.ndarray, "tx rx delay"] | None = None
    packets: Complex64[np.ndarray, "packet tx rx subcarrier"] | None = None


class Kind(Protocol):
    """One kind of report."""

    def report(self, csi: Complex64[np.ndarray, "tx rx subcarrier"], seen: Visible) -> Reported:
        """What the radio reports of a channel.

        What is hidden enters no delay profile and no phase; NaN of a lost packet stays NaN.
        """
        ...

    def change(
        self, csi: Complex64[np.ndarray, "packet tx rx subcarrier"], empty: Reported, seen: Visible
    ) -> Change:
        """What the packets of a frame change.

        Args:
            csi: The channels.
            empty: What is reported of the empty room.
            seen: What may be used.
        """
        ...


class _Complex:
    def report(self, csi: np.ndarray, seen: Visible) -> Reported:
        return csi

    def change(self, csi: np.ndarray, empty: Reported, seen: Visible) -> Change:
        if len(csi) == 1:
            return Change(csi[0] - empty, empty)
        packets = change_of_packets(csi - empty, seen.links, seen.subcarriers, seen.layout)
        return Change(packets[0], empty, packets=packets)


class _Power:
    def report(self, csi: np.ndarray, seen: Visible) -> Reported:
        return np.abs(csi)

    def change(self, csi: np.ndarray, empty: Reported, seen: Visible) -> Change:
        wave = direct_wave(seen.layout, seen.freq_hz)
        # Hidden links must not set the scale of the others.
        now = np.where(seen.entries, self.report(csi[0], seen), 0)
        empty = np.where(seen.entries, empty, 0)
        return Change(hologram(now, empty, seen.subcarriers, wave), empty * wave)


class _DelayPower:
    def report(self, csi: np.ndarray, seen: Visible) -> Reported:
        return delay_amplitude(csi, seen.subcarriers)

    def change(self, csi: np.ndarray, empty: Reported, seen: Visible) -> Change:
        change = np.abs(self.report(csi[0], seen) - empty)
        change = np.where(seen.links[..., None], change, 0).astype(np.float32)
        spacing_hz = float(seen.freq_hz[1] - seen.freq_hz[0])
        direct = direct_amplitude(empty, seen.layout, spacing_hz)
        static = direct[..., None] * direct_wave(seen.layout, seen.freq_hz)
        return Change(np.zeros_like(static), static, delay_change=change)


class _Relative:
    """CSI ratios or conjugate products; the empty room is a packet on its direct paths."""

    def __init__(self, kind: Relative) -> None:
        self._kind: Relative = kind

    def report(self, csi: np.ndarray, seen: Visible) -> Reported:
        return on_direct_paths(csi, seen.links, seen.subcarriers, seen.layout, seen.freq_hz)

    def change(self, csi: np.ndarray, empty: Reported, seen: Visible) -> Change:
        args = seen.links, seen.subcarriers, seen.layout
        return Change(relative_change(self._kind, csi[0], empty, *args), empty)


#: Every kind by its name in the settings.
KINDS: dict[Observe, Kind] = {
    "complex": _Complex(),
    "power": _Power(),
    "delay_power": _DelayPower(),
    "csi_ratio": _Relative("csi_ratio"),
    "conjugate": _Relative("conjugate"),
}
