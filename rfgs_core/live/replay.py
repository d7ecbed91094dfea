# SPDX-License-Identifier: Apache-2.0
"""A recording that is played at its own pace, as if its radios were sending now."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.capture.layout_file import CaptureLayout
from rfgs_core.capture.prepare import prepare
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.live.counts import Counts
from rfgs_core.live.phases import Bins, OwnUnits
from rfgs_core.live.setting import Heard, Reported, Setting, every_nth
from rfgs_core.measure.observations import visible_channel
from rfgs_core.radio import layout


@dataclass(frozen=True)
class Recording:
    """Channels over time."""

    setting: Setting
    """What they are of."""
    time_s: Float64[np.ndarray, "packet"]
    """When each was taken, ascending [s]."""
    read: Callable[[int], Complex64[np.ndarray, "tx rx subcarrier"]]
    """Reads one of them, all subcarriers."""
    kept: np.ndarray
    """Subcarriers that are followed."""
    own_units: Bins | None = None
    """What packets hold, where levels and phases are those of cards."""


def recorded_dataset(
    path: Path, sequence: str | None, radio: str | None, reported: Reported
) -> Recording:
    """A sequence of a dataset.

    Args:
        path: The dataset.
        sequence: Which sequence; None where there is one.
        radio: Which radio; None where there is one.
        reported: What of the channel is trusted.

    Raises:
        RfgsError: There is no such sequence or radio, or its antennas move.
    """
    chosen = open_dataset(path).sequence(sequence)
    if radio is None and len(chosen.radios) > 1:
        raise RfgsError(f"{path}: expected --radio, one of {', '.join(chosen.radios)}")
    name = radio or chosen.radios[0]
    if chosen.radio_spec(name).antennas_move:
        raise RfgsError(f"{path}: antennas of {name} move, which a stream cannot follow")
    elements, _, subcarriers, _ = visible_channel(
        chosen, name, chosen.frames[0], "clean", everything=True
    )
    freq_hz = np.array(chosen.coordinates(name)["freq_hz"].values, np.float64)
    kept = every_nth(len(freq_hz))
    setting = Setting(
        name=chosen.name,
        devices=chosen.devices(name),
        layout=elements,
        freq_hz=freq_hz[kept],
        subcarriers=subcarriers[kept],
        bounds_m=np.asarray(chosen.bounds_m, np.float64),
        reported=reported,
        static=chosen.csi_static(name)[..., kept],
    )
    frames = chosen.frames
    times = [chosen.sample_times_s(name, frame) for frame in frames]
    rows = [
        (frame, row) for frame, own in zip(frames, times, strict=True) for row in range(len(own))
    ]
    last: list[tuple[int, np.ndarray]] = []

    def read(index: int) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        frame, row = rows[index]
        if not last or last[0][0] != frame:
            packets = visible_channel(chosen, name, frame, "clean", "all", everything=True)[3]
            last[:] = [(frame, packets)]
        return last[0][1][row]

    return Recording(setting, np.concatenate(times), read, kept)


def recorded_captures(
    files: Sequence[Path],
    given: CaptureLayout,
    reported: Reported,
    on_warning: Callable[[str], Any] = lambda _: None,
) -> Recording:
    """Captures of one radio, a file for each device that receives.

    Args:
        files: The files.
        given: Where the devices stood.
        reported: What of the packets is trusted.
        on_warning: Is told what readers found damaged or left out.

    Raises:
        RfgsError: A file cannot be read, or files and devices do not go together.
    """
    prepared, warnings = prepare(list(files), given)
    for warning in warnings:
        on_warning(warning)
    radio, devices = prepared.radio, prepared.devices
    frames, samples = prepared.csi.shape[:2]
    kept = every_nth(radio.num_subcarriers)
    offset_s = np.arange(samples) * radio.sample_interval_s
    setting = Setting(
        name=given.name,
        devices=devices,
        layout=layout(radio, devices),
        freq_hz=radio.freq_hz[kept],
        subcarriers=prepared.measured[kept],
        bounds_m=prepared.bounds_m,
        reported=reported,
    )
    packets = prepared.csi.reshape(frames * samples, *prepared.csi.shape[2:])
    times_s = (np.arange(frames)[:, None] / prepared.fps + offset_s).ravel()
    bins = Bins(radio.freq_hz, np.arange(radio.num_subcarriers), prepared.measured, kept)
    return Recording(setting, times_s, lambda row: packets[row], kept, own_units=bins)


class Replay:
    """A recording from the moment on when it is first asked for packets.

    It is read as it is taken, so a program that falls behind makes it wait and loses nothing.
    """

    def __init__(self, recording: Recording, rate: float = 1.0) -> None:
        """Waits for the first `take`: whoever follows it may have much to load before.

        Args:
            recording: What to play.
            rate: Seconds of the recording per second.

        Raises:
            RfgsError: The rate is not above zero.
        """
        if not rate > 0.0:
            raise RfgsError(f"--rate {rate}: expected a number above 0")
        self.setting = recording.setting
        self.counts = [Counts() for _ in self.setting.receivers]
        self._recording, self._next = recording, 0
        self._own_units = [
            OwnUnits(self.setting, device, recording.own_units)
            for device in self.setting.receivers
            if recording.own_units is not None
        ]
        first_s = float(recording.time_s[0])
        self._after_s = (recording.time_s - first_s) / rate
        self._began_s: float | None = None

    @property
    def ended(self) -> bool:
        """Whether everything was taken."""
        return self._next == len(self._after_s)

    def take(self, now_s: float) -> list[Heard]:
        """Packets that are due since the last call."""
        if self._began_s is None:
            self._began_s = now_s
        until = int(np.searchsorted(self._after_s, now_s - self._began_s, side="right"))
        rows, self._next = range(self._next, until), max(until, self._next)
        if not rows:
            return []
        csi = np.stack([self._recording.read(row) for row in rows])
        due_s = self._began_s + self._after_s[rows.start : rows.stop]
        return [self._heard(row, device, csi, due_s) for row, device in self._numbered()]

    def close(self) -> None:
        """Nothing is open."""

    def _numbered(self) -> list[tuple[int, int]]:
        return list(enumerate(self.setting.receivers))

    def _heard(self, row: int, device: int, csi: np.ndarray, due_s: np.ndarray) -> Heard:
        tx, rx = self.setting.block(device)
        values = np.swapaxes(csi[:, tx[:, None], rx], 1, 2).astype(np.complex64)
        if self._own_units:
            values = self._own_units[row](values)
        else:
            values = values[..., self._recording.kept]
        self.counts[row].received += len(due_s)
        return Heard(device, due_s, due_s, values)
