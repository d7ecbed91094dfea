# SPDX-License-Identifier: Apache-2.0
"""A frame's channel, one block of antennas and subcarriers per device pair, preprocessed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Complex, Complex64, Float64, Int64
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
    """Subcarriers [Hz]."""
    packets: Complex64[Tensor, "pair packet tx rx subcarrier"] | None = None
    """Preprocessed change of each packet, in units of the RMS of all of a pair's packets; None
    where one was read."""

    def __len__(self) -> int:
        return len(self.csi)

    @staticmethod
    def of(seen: FrameChannel) -> Blocks:
        """Subcarriers scaled to equal power (section 3.6), then pairs to an RMS of one."""
        normal, _ = normalise_subcarriers(seen.delta, seen.links)
        _, pairs = seen.pairs
        elements = [seen.layout.block_of(*pair) for pair in pairs]
        rows = (np.array([tx for tx, _ in elements]), np.array([rx for _, rx in elements]))
        tx, rx = rows[0][:, :, 0], rows[1][:, 0]
        visible = seen.links[rows][..., None] & seen.subcarriers
        csi = np.where(visible, normal[rows], 0)
        return Blocks(
            csi=_unit_rms(csi, visible),
            visible=torch.from_numpy(visible),
            tx=tx,
            rx=rx,
            tx_xyz=torch.from_numpy(seen.layout.tx_xyz[tx]),
            rx_xyz=torch.from_numpy(seen.layout.rx_xyz[rx]),
            freq_hz=torch.from_numpy(seen.freq_hz),
            packets=_packets(seen, rows, visible),
        )

    def choose(self, pairs: Int64[np.ndarray, "chosen"]) -> Blocks:
        """Some of the device pairs."""
        rows = torch.from_numpy(pairs)
        return Blocks(
            csi=self.csi[rows],
            visible=self.visible[rows],
            tx=self.tx[pairs],
            rx=self.rx[pairs],
            tx_xyz=self.tx_xyz[rows],
            rx_xyz=self.rx_xyz[rows],
            freq_hz=self.freq_hz,
            packets=None if self.packets is None else self.packets[rows],
        )

    def hide(self, mask: Bool[Tensor, "pair tx rx subcarrier"]) -> Blocks:
        """The same with more of it hidden."""
        visible = self.visible & ~mask
        packets = None if self.packets is None else self.packets * visible[:, None]
        return replace(self, csi=self.csi * visible, visible=visible, packets=packets)


def _unit_rms(
    csi: Complex[np.ndarray, "pair *axes"], visible: Bool[np.ndarray, "pair *axes"]
) -> Complex64[Tensor, "pair *axes"]:
    """The channel of each pair in units of its RMS over visible entries; silence stays zero."""
    axes = tuple(range(1, csi.ndim))
    power = np.sum(np.abs(csi) ** 2, axis=axes, keepdims=True)
    power = power / np.sum(visible, axis=axes, keepdims=True)
    return torch.from_numpy((csi / np.sqrt(np.where(power > 0.0, power, 1.0))).astype(np.complex64))


def _packets(
    seen: FrameChannel,
    rows: tuple[np.ndarray, np.ndarray],
    visible: Bool[np.ndarray, "pair tx rx subcarrier"],
) -> Complex64[Tensor, "pair packet tx rx subcarrier"] | None:
    """Packets like `Blocks.csi`: all of them share the scale of a subcarrier and of a pair."""
    if seen.packets is None:
        return None
    tx, rx = np.nonzero(seen.links)
    power = np.mean(np.abs(seen.packets[:, tx, rx]) ** 2, axis=(0, 1))
    gain = np.divide(1.0, np.sqrt(power), out=np.zeros_like(power), where=power > 0.0)
    blocks = np.moveaxis(seen.packets[:, rows[0], rows[1]], 0, 1) * gain
    everywhere = np.broadcast_to(visible[:, None], blocks.shape)
    return _unit_rms(np.where(everywhere, blocks, 0), everywhere)
