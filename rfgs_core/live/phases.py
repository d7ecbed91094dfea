# SPDX-License-Identifier: Apache-2.0
"""Packets of cards that share no phase, turned onto what stands still.

A packet of a card is e^{j(φ + s k)} (S + Δ): φ and s, its oscillator's phase and its timing, are
drawn anew for each packet, k is the subcarrier, S the empty room and Δ what somebody changes of it.
As |Δ| ≪ |S|, arg Σ H S̄ over all antennas and subcarriers tells both, and turning the packet back
costs two of the many dimensions of Δ: what looks like a phase or a delay of all antennas. Powers
would cost half of them, and leave a twin (`measure.phase_free`).

S is the running mean of packets that were turned back. Its own phase and timing are those of the
direct path of each link, which follow from where the antennas stand; they are wrong where the
direct path is not the strongest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex64, Complex128, Float, Float64, Int64

from rfgs_core.live.setting import Setting
from rfgs_core.measure.phase_free import direct_wave
from rfgs_core.sanitize.gaps import phase_step

#: The running mean forgets after so many packets.
_MEMORY = 20_000


class Bins(NamedTuple):
    """Bins of packets as they come."""

    freq_hz: Float64[np.ndarray, "bin"]
    """Frequencies [Hz]."""
    index: Int64[np.ndarray, "bin"]
    """Their numbers; neighbours in frequency are one apart."""
    measured: Bool[np.ndarray, "bin"]
    """Where they were measured, neither pilots nor filled."""


class Straightener:
    """Turns packets of one device onto its empty room."""

    def __init__(self, setting: Setting, device: int, bins: Bins) -> None:
        """Nothing was heard yet.

        Args:
            setting: Antennas.
            device: Which device receives.
            bins: What packets hold, before any subcarrier is left out: timing turns phases far.
        """
        tx, rx = setting.block(device)
        self._index = bins.index
        self._used: Int64[np.ndarray, "used"] = np.flatnonzero(bins.measured)
        wave = direct_wave(setting.layout, bins.freq_hz[self._used])[np.ix_(tx, rx)]
        self._direct: Complex64[np.ndarray, "rx tx used"] = np.swapaxes(wave, 0, 1)
        self._mean: Complex128[np.ndarray, "rx tx used"] | None = None
        self._count = 0

    def __call__(
        self, values: Complex64[np.ndarray, "packet rx tx subcarrier"]
    ) -> Complex64[np.ndarray, "packet rx tx subcarrier"]:
        """The packets less their phase and timing; they also count for what follows."""
        seen = values[..., self._used]
        if self._mean is None:
            self._mean = self._tied(seen[0].astype(np.complex128))
        step, phase = self._offsets(seen, self._mean)
        turn = np.exp(-1j * (phase[:, None] + step[:, None] * self._index))
        turned = values * turn.astype(np.complex64)[:, None, None]
        self._count = min(self._count + len(values), _MEMORY)
        share = len(values) / max(self._count, len(values))
        now = turned[..., self._used].mean(axis=0)
        self._mean = self._tied(self._mean + share * (now - self._mean))
        return turned

    def _tied(
        self, mean: Complex128[np.ndarray, "rx tx used"]
    ) -> Complex128[np.ndarray, "rx tx used"]:
        """An empty room with the timing of the direct paths, and each link with its phase."""
        step, _ = self._offsets(mean[None], self._direct)
        mean = mean * np.exp(-1j * step[0] * self._index[self._used])
        match = (mean * self._direct.conj()).sum(axis=-1, keepdims=True)
        return mean * np.exp(-1j * np.angle(match))

    def _offsets(
        self, values: Complex64[np.ndarray, "packet rx tx used"], reference: np.ndarray
    ) -> tuple[Float[np.ndarray, "packet"], Float64[np.ndarray, "packet"]]:
        """Phase step per subcarrier, and phase, of packets against a reference [rad]."""
        index = self._index[self._used]
        match = values * reference.conj()
        links = match.reshape(len(match), -1, len(index))
        step = phase_step(links, index, shared=True)
        turned = links.sum(axis=1) * np.exp(-1j * step[:, None] * index)
        return step, np.angle(turned.sum(axis=-1))


class OwnUnits:
    """Packets in units of their card become channels that can be compared."""

    def __init__(self, setting: Setting, device: int, bins: Bins) -> None:
        """Nothing was heard yet.

        Args:
            setting: Antennas, and whether phases are asked for.
            device: Which device receives.
            bins: What packets hold.
        """
        self._level = setting.free_space(device)
        asked = setting.reported == "complex"
        self._straighten = Straightener(setting, device, bins) if asked else None

    def __call__(
        self, values: Complex64[np.ndarray, "packet rx tx subcarrier"]
    ) -> Complex64[np.ndarray, "packet rx tx subcarrier"]:
        """Channels of the level of free space, turned back if phases are asked for."""
        values = levelled(values, self._level)
        return values if self._straighten is None else self._straighten(values)


def levelled(
    values: Complex64[np.ndarray, "packet rx tx subcarrier"], amplitude: float
) -> Complex64[np.ndarray, "packet rx tx subcarrier"]:
    """Packets of one RMS amplitude: gains of cards change in steps that nobody tells exactly.

    What a person changes of the level of all antennas and subcarriers alike is lost with the gain;
    what remains is how it differs between them.
    """
    power = np.mean(np.abs(values) ** 2, axis=(1, 2, 3), keepdims=True)
    return (values * (amplitude / np.sqrt(np.maximum(power, 1e-30)))).astype(np.complex64)
