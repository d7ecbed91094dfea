# SPDX-License-Identifier: Apache-2.0
"""A sequence's channels as a torch Dataset."""

from __future__ import annotations

from typing import Any

import torch
from torch.utils.data import Dataset as TorchDataset

from rfgs_core.dataset.reader import Sequence


class FrameDataset(TorchDataset[dict[str, Any]]):
    """One item per frame: `frame`, `time_s`, `csi` and `csi_static` (tx, rx, subcarrier).

    Example:
        `DataLoader(FrameDataset(open_dataset(path).sequence(), "wifi"), batch_size=4)`
    """

    def __init__(self, sequence: Sequence, radio: str, frames: list[int] | None = None) -> None:
        """Keeps the static channel and reads the others frame by frame.

        Args:
            sequence: Where the frames are.
            radio: Which radio.
            frames: Which frames; None takes all.
        """
        self.sequence = sequence
        self.radio = radio
        self.frames = sequence.frames if frames is None else list(frames)
        self.csi_static = torch.from_numpy(sequence.csi_static(radio))
        self.measured = torch.from_numpy(sequence.layout(radio).measured)

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> dict[str, Any]:
        frame = self.frames[index]
        return {
            "frame": frame,
            "time_s": self.sequence.time_s(frame),
            "csi": torch.from_numpy(self.sequence.csi(self.radio, frame)),
            "csi_static": self.csi_static,
            "measured": self.measured,
        }
