# SPDX-License-Identifier: Apache-2.0
"""What stays the same while packets come: antennas, subcarriers, bounds, what is reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from jaxtyping import Bool, Complex64, Float64, Int64

from rfgs_core.radio import DevicePose, Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: What windows are compared by: the channel itself, or powers without phases.
Reported = Literal["complex", "power"]
#: So many subcarriers are followed, evenly spread over the band; more say the same of a room.
MOST_SUBCARRIERS = 64


@dataclass(frozen=True)
class Heard:
    """Packets of one receiving device."""

    device: int
    """Which of the setting's devices."""
    time_s: Float64[np.ndarray, "packet"]
    """When each was received, on our clock [s]."""
    arrived_s: Float64[np.ndarray, "packet"]
    """When it reached the program [s]."""
    values: Complex64[np.ndarray, "packet rx tx subcarrier"]
    """Channels on the subcarriers of the setting."""


@dataclass(frozen=True)
class Setting:
    """Radios of a stream."""

    name: str
    """Name of the scene."""
    devices: list[DevicePose]
    """Where the radios stand."""
    layout: Layout
    """Their antenna elements."""
    freq_hz: Float64[np.ndarray, "subcarrier"]
    """Subcarriers that are followed [Hz], evenly spaced."""
    subcarriers: Bool[np.ndarray, "subcarrier"]
    """Which of them are measured."""
    bounds_m: Float64[np.ndarray, "2 3"]
    """Where people may be [m]."""
    reported: Reported
    """What of the channel is trusted."""
    static: Complex64[np.ndarray, "tx rx subcarrier"] | None = None
    """Channel of the empty room, where somebody recorded it."""

    @property
    def receivers(self) -> list[int]:
        """Devices that hear."""
        return sorted(set(self.layout.rx_device.tolist()))

    def block(self, device: int) -> tuple[Int64[np.ndarray, "tx"], Int64[np.ndarray, "rx"]]:
        """Elements that a receiving device hears, and those it hears with."""
        rx = np.flatnonzero(self.layout.rx_device == device)
        return np.flatnonzero(self.layout.measured[:, rx].any(axis=1)), rx

    def free_space(self, device: int) -> float:
        """Amplitude λ/(4πd) of the direct path to a receiving device, at its mean distance."""
        tx, rx = self.block(device)
        apart = self.layout.tx_xyz[tx].mean(axis=0) - self.layout.rx_xyz[rx].mean(axis=0)
        wavelength_m = SPEED_OF_LIGHT / float(self.freq_hz.mean())
        return wavelength_m / (4.0 * np.pi * max(float(np.linalg.norm(apart)), 0.1))


class Source(Protocol):
    """Where packets come from."""

    setting: Setting
    """What they are of."""

    def take(self, now_s: float) -> list[Heard]:
        """Packets that came since the last call."""
        ...

    @property
    def ended(self) -> bool:
        """Whether there will be no more."""
        ...

    def close(self) -> None:
        """Ends it."""
        ...


def every_nth(count: int) -> Int64[np.ndarray, "kept"]:
    """Subcarriers that are followed of so many, evenly spaced."""
    return np.arange(0, count, -(-count // MOST_SUBCARRIERS))
