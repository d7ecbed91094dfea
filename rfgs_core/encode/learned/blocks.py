# SPDX-License-Identifier: Apache-2.0
"""A frame's channel, one block of antennas and tones per device pair, preprocessed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Complex64, Float64, Int64
from torch import Tensor

from rfgs_core.encode.preprocess import normalise_subcarriers
from rfgs_core.encode.protocol import FrameChannel


@dataclass(frozen=True)
class Blocks:
    """What networks see: the channel of each device pair in units of that pair's own RMS."""

    csi: Complex64[Tensor, "pair tx rx subcarrier"]
    """Preprocessed channel, zero where hidden."""
    visible: Bool[Tensor, "pair tx rx subcarrier"]
    """What may be read."""
    tx: Int64[np.ndarray, "pair tx"]
    """Transmitting elements of each pair."""
    rx: Int64[np.ndarray, "pair rx"]
    """Receiving elements of each pair."""
    tx_xyz: Float64[Tensor, "pair tx 3"]
    """Their positions [m]."""
    rx_xyz: Float64[Tensor, "pair rx 3"]
    """Their positions [m]."""
    freq_hz: Float64[Tensor, "subcarrier"]
    """Tones [Hz]."""

    def __len__(self) -> int:
        return len(self.csi)

    @staticmethod
    def of(seen: FrameChannel) -> Blocks:
        """Subcarriers scaled to equal power (section 3.6), then pairs to an RMS of one."""
        normal, _ = normalise_subcarriers(seen.delta, seen.links)
        _, pairs = seen.pairs
        tx = np.array([np.flatnonzero(seen.layout.tx_device == a) for a, _ in pairs])
        rx = np.array([np.flatnonzero(seen.layout.rx_device == b) for _, b in pairs])
        rows = (tx[:, :, None], rx[:, None, :])
        visible = seen.links[rows][..., None] & seen.tones
        csi = np.where(visible, normal[rows], 0)
        power = np.sum(np.abs(csi) ** 2, axis=(1, 2, 3)) / np.sum(visible, axis=(1, 2, 3))
        csi = csi / np.sqrt(np.where(power > 0.0, power, 1.0))[:, None, None, None]
        return Blocks(
            csi=torch.from_numpy(csi.astype(np.complex64)),
            visible=torch.from_numpy(visible),
            tx=tx,
            rx=rx,
            tx_xyz=torch.from_numpy(seen.layout.tx_xyz[tx]),
            rx_xyz=torch.from_numpy(seen.layout.rx_xyz[rx]),
            freq_hz=torch.from_numpy(seen.freq_hz),
        )

    def choose(self, pairs: Int64[np.ndarray, "chosen"]) -> Blocks:
        """Some of the device pairs."""
        rows = torch.from_numpy(pairs)
        return Blocks(
            *(self.csi[rows], self.visible[rows], self.tx[pairs], self.rx[pairs]),
            *(self.tx_xyz[rows], self.rx_xyz[rows], self.freq_hz),
        )

    def hide(self, mask: Bool[Tensor, "pair tx rx subcarrier"]) -> Blocks:
        """The same with more of it hidden."""
        visible = self.visible & ~mask
        return replace(self, csi=self.csi * visible, visible=visible)
