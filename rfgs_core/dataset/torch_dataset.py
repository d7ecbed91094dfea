# SPDX-License-Identifier: Apache-2.0
"""A sequence's channels as a torch Dataset."""

from __future__ import annotations

from typing import Any

import torch
from torch.utils.data import Dataset as TorchDataset

from rfgs_core.dataset.sequence import Sequence


class FrameDataset(TorchDataset[dict[str, Any]]):
    """One item per frame: `frame`, `time_s`, `csi` and `csi_static` (tx, rx, subcarrier).

    With `samples=True`, `time_s` is (sample,) and `csi` (sample, tx, rx, subcarrier): all
    packets, chirps or pulses of the frame. `csi_static` has that axis too, of length 1 unless
    the antennas move within a frame.

    Example:
        `DataLoader(FrameDataset(open_dataset(path).sequence(), "wifi"), batch_size=4)`
    """

    def __init__(
        self,
        sequence: Sequence,
        radio: str,
        frames: list[int] | None = None,
        *,
        samples: bool = False,
    ) -> None:
        """Keeps the static channel and reads the others frame by frame.

        Args:
            sequence: Where the frames are.
            radio: Which radio.
            frames: Which frames; None takes all.
            samples: All samples of each frame, not only the one at its own time.
        """
        self.sequence = sequence
        self.radio = radio
        self.frames = sequence.frames if frames is None else list(frames)
        self.samples = samples
        static = sequence.csi_static_samples(radio)
        self.csi_static = torch.from_numpy(static if samples else static[0])
        self.measured = torch.from_numpy(sequence.layout(radio).measured)

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> dict[str, Any]:
        frame = self.frames[index]
        csi = self.sequence.csi_samples(self.radio, frame)
        times_s = torch.from_numpy(self.sequence.sample_times_s(self.radio, frame))
        return {
            "frame": frame,
            "time_s": times_s if self.samples else self.sequence.time_s(frame),
            "csi": torch.from_numpy(csi if self.samples else csi[0]),
            "csi_static": self.csi_static,
            "measured": self.measured,
        }
