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
from jaxtyping import Bool, Complex64, Float, Float64, Int64

from rfgs_core.live.setting import Setting
from rfgs_core.measure.phase_free import direct_wave
from rfgs_core.sanitize.gaps import phase_step

#: The running mean forgets after so many packets.
_MEMORY = 20_000


class Bins(NamedTuple):
    """Bins of packets as they come, and which of them are followed."""

    freq_hz: Float64[np.ndarray, "bin"]
    """Frequencies [Hz]."""
    index: Int64[np.ndarray, "bin"]
    """Their numbers; neighbours in frequency are one apart."""
    measured: Bool[np.ndarray, "bin"]
    """Where they were measured, neither pilots nor filled."""
    followed: Int64[np.ndarray, "followed"]
    """Rows of those that are followed."""


class Straightener:
    """Turns packets of one device onto its empty room.

    Timing may turn phases by more than half a turn between bins that are followed: the step is told
    roughly from each of them and its neighbour, then finely from those that are followed.
    """

    def __init__(self, setting: Setting, device: int, bins: Bins) -> None:
        """Nothing was heard yet.

        Args:
            setting: Antennas.
            device: Which device receives.
            bins: What packets hold.
        """
        tx, rx = setting.block(device)
        self._followed, self._index = bins.followed, bins.index[bins.followed]
        self._used: Int64[np.ndarray, "used"] = np.flatnonzero(bins.measured[bins.followed])
        rows = bins.followed[self._used]
        after = np.minimum(rows + 1, len(bins.index) - 1)
        paired = (bins.index[after] == bins.index[rows] + 1) & bins.measured[after]
        self._paired, self._after = np.flatnonzero(paired), after[paired]
        self._rows = np.concatenate([rows, self._after])
        wave = direct_wave(setting.layout, bins.freq_hz[self._rows])[np.ix_(tx, rx)]
        self._direct: Complex64[np.ndarray, "rx tx row"] = np.swapaxes(wave, 0, 1)
        self._mean: Complex64[np.ndarray, "rx tx row"] | None = None
        self._count = 0

    def __call__(
        self, values: Complex64[np.ndarray, "packet rx tx bin"]
    ) -> Complex64[np.ndarray, "packet rx tx followed"]:
        """Followed bins of packets less their phase and timing; they count for what comes next."""
        seen = values[..., self._rows]
        if self._mean is None:
            self._mean = self._tied(seen[0])
        step, phase = self._offsets(seen, self._mean)
        turned = values[..., self._followed] * _turn(step, phase, self._index)
        self._count = min(self._count + len(values), _MEMORY)
        share = np.float32(len(values) / max(self._count, len(values)))
        now = (seen * _turn(step, phase, self._of_rows)).mean(axis=0)
        self._mean = self._tied(self._mean + share * (now - self._mean))
        return turned

    @property
    def _of_rows(self) -> Int64[np.ndarray, "row"]:
        """Numbers of the bins that offsets are told from."""
        own = self._index[self._used]
        return np.concatenate([own, own[self._paired] + 1])

    def _tied(self, mean: Complex64[np.ndarray, "rx tx row"]) -> Complex64[np.ndarray, "rx tx row"]:
        """An empty room with the timing of the direct paths, and each link with its phase."""
        step, _ = self._offsets(mean[None], self._direct)
        mean = mean * _turn(step, np.zeros(1), self._of_rows)[0]
        match = (mean * self._direct.conj()).sum(axis=-1, keepdims=True)
        return (mean * np.exp(-1j * np.angle(match))).astype(np.complex64)

    def _offsets(
        self, values: Complex64[np.ndarray, "packet rx tx row"], reference: np.ndarray
    ) -> tuple[Float[np.ndarray, "packet"], Float[np.ndarray, "packet"]]:
        """Phase step per subcarrier, and phase, of packets against a reference [rad]."""
        index, count = self._index[self._used], len(self._used)
        links = (values * reference.conj()).reshape(len(values), -1, values.shape[-1])
        own, after = links[..., :count], links[..., count:]
        rough = np.angle((own[..., self._paired].conj() * after).sum(axis=(1, 2)))
        left = own * _turn(rough, np.zeros(1), index)[:, 0]
        fine = phase_step(left, index, shared=True)
        still = left.sum(axis=1) * _turn(fine, np.zeros(1), index)[:, 0, 0]
        return rough + fine, np.angle(still.sum(axis=-1))


def _turn(
    step: Float[np.ndarray, "packet"],
    phase: Float[np.ndarray, "packet"],
    index: Int64[np.ndarray, "row"],
) -> Complex64[np.ndarray, "packet 1 1 row"]:
    """Phasors that take a phase, and a step per subcarrier, back."""
    turns = (phase[:, None] + step[:, None] * index).astype(np.float32)
    return np.exp(np.complex64(-1j) * turns)[:, None, None]


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
        self._followed = bins.followed
        asked = setting.reported == "complex"
        self._straighten = Straightener(setting, device, bins) if asked else None

    def __call__(
        self, values: Complex64[np.ndarray, "packet rx tx bin"]
    ) -> Complex64[np.ndarray, "packet rx tx followed"]:
        """Followed bins, of the level of free space, turned back if phases are asked for."""
        values = levelled(values, self._level)
        return values[..., self._followed] if self._straighten is None else self._straighten(values)


def levelled(
    values: Complex64[np.ndarray, "packet rx tx subcarrier"], amplitude: float
) -> Complex64[np.ndarray, "packet rx tx subcarrier"]:
    """Packets of one RMS amplitude: gains of cards change in steps that nobody tells exactly.

    What a person changes of the level of all antennas and subcarriers alike is lost with the gain;
    what remains is how it differs between them.
    """
    power = np.mean(np.abs(values) ** 2, axis=(1, 2, 3), keepdims=True)
    return (values * (amplitude / np.sqrt(np.maximum(power, 1e-30)))).astype(np.complex64)
