# SPDX-License-Identifier: Apache-2.0
"""A learned encoder: network, propagation to the points, attention over device pairs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Complex, Float, Float32, Float64
from torch import Tensor, nn

from rfgs_core.encode.back_projection import POINTS, back_project, oversampled_profiles
from rfgs_core.encode.learned.blocks import Blocks
from rfgs_core.encode.learned.networks import NETWORKS, NetworkKind
from rfgs_core.encode.learned.signature import RadioSignature
from rfgs_core.encode.learned.steering import focus, steering
from rfgs_core.encode.protocol import FEATURES, FrameChannel
from rfgs_core.errors import RfgsError
from rfgs_core.threads import one_torch_thread

#: Features that are read at once.
_CHANNELS = 8


class EncoderModel(nn.Module):
    """Everything that is trained and stored."""

    def __init__(self, kind: NetworkKind, seed: int) -> None:
        super().__init__()
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.network = NETWORKS[kind]()
            self.attention = PairAttention()

    def join(
        self,
        focused: Complex[Tensor, "pair 32 N"],
        blocks: Blocks,
        points: Float64[Tensor, "N 3"],
    ) -> Float[Tensor, "N 32"]:
        """φ from what each device pair says at the points."""
        ends = [blocks.tx_xyz.mean(dim=1), blocks.rx_xyz.mean(dim=1)]
        legs_m = torch.stack([torch.linalg.norm(points - end[:, None], dim=-1) for end in ends], -1)
        power = focused.real.square() + focused.imag.square()
        return self.attention(power.transpose(1, 2), legs_m.float())

    def at_points(
        self, blocks: Blocks, points: Float64[Tensor, "N 3"]
    ) -> tuple[Float[Tensor, "N 32"], list[Complex[Tensor, "N"]], list[Tensor]]:
        """φ at few points, with gradients.

        Returns:
            φ, the image of each device pair summed over features, and its steering.
        """
        weighed, steer, focused = self.network(blocks), [], []
        for pair in range(len(blocks)):
            links = max(1, int(blocks.visible[pair].any(dim=-1).sum()))
            steer.append(steering(blocks, pair, points))
            focused.append(focus(weighed[pair], steer[-1], links))
        features = self.join(torch.stack(focused), blocks, points)
        return features, [image.sum(dim=0) for image in focused], steer


@dataclass(frozen=True)
class LearnedEncoder:
    """`Encoder` that reads its model at any number of points, without gradients."""

    kind: NetworkKind
    """Which network."""
    model: EncoderModel
    """Its weights."""
    radio: RadioSignature
    """What radio it was made for."""
    name: str = "this encoder"
    """Its file, for messages."""

    @staticmethod
    def untrained(kind: NetworkKind, seen: FrameChannel, seed: int) -> LearnedEncoder:
        """An encoder for the radio of a frame, its weights all one.

        Raises:
            RfgsError: The network cannot take this radio's arrays, or lacks its packets.
        """
        radio = signature(kind, seen)
        if kind in ("cube", "doppler"):
            radio.need_linear_arrays(kind)
        if kind == "doppler" and seen.packets is None:
            raise RfgsError(
                "the doppler network expects several packets per frame, one is read; generate them "
                "with --packets-per-frame, leave out --packets first, or use --network cube"
            )
        return LearnedEncoder(kind, EncoderModel(kind, seed), radio)

    def __call__(
        self, seen: FrameChannel, points: Float64[np.ndarray, "N 3"]
    ) -> Float32[np.ndarray, "N 32"]:
        """Features at points, see `Encoder`.

        Raises:
            RfgsError: The frame is of another radio.
        """
        self.radio.refuse_others(signature(self.kind, seen), self.name)
        blocks = Blocks.of(seen)
        pair, _ = seen.pairs
        with torch.no_grad(), one_torch_thread():
            weighed = _per_link(self.model.network(blocks), blocks, pair)
            profiles = [
                oversampled_profiles(weighed[:, first : first + _CHANNELS], seen.freq_hz)
                for first in range(0, FEATURES, _CHANNELS)
            ]
            rows = [
                self._read(profiles, seen, blocks, pair, points[start : start + POINTS])
                for start in range(0, len(points), POINTS)
            ]
        return np.concatenate([np.zeros((0, FEATURES), np.float32), *rows])

    def _read(
        self,
        profiles: list[tuple[np.ndarray, float, float]],
        seen: FrameChannel,
        blocks: Blocks,
        pair: np.ndarray,
        points: Float64[np.ndarray, "N 3"],
    ) -> Float32[np.ndarray, "N 32"]:
        parts = [
            back_project(
                profile,
                centre_k=np.full(_CHANNELS, centre_k),
                samples_per_m=samples_per_m,
                tx_xyz=seen.layout.tx_xyz,
                rx_xyz=seen.layout.rx_xyz,
                pair=pair,
                points=points,
            )
            for profile, centre_k, samples_per_m in profiles
        ]
        focused = torch.from_numpy(np.concatenate(parts, axis=1))
        return self.model.join(focused, blocks, torch.from_numpy(points)).numpy()


def signature(kind: NetworkKind, seen: FrameChannel) -> RadioSignature:
    """What a network of some kind depends on of a frame's radio: one alone knows of packets."""
    if kind != "doppler" or seen.packets is None:
        return RadioSignature.of(seen.layout, seen.freq_hz)
    count, interval_s = len(seen.packets), seen.packet_interval_s
    return RadioSignature.of(seen.layout, seen.freq_hz, count, interval_s)


def _per_link(
    weighed: Complex[Tensor, "pair 32 tx rx subcarrier"], blocks: Blocks, pair: np.ndarray
) -> Complex[np.ndarray, "link 32 subcarrier"]:
    """The weighed channel in the order of the visible links."""
    of_pair, t, r = blocks.visible.any(dim=-1).nonzero().T.numpy()
    row = np.zeros(pair.shape, dtype=np.int64)
    row[pair >= 0] = np.arange((pair >= 0).sum())
    links = np.zeros((len(of_pair), FEATURES, len(blocks.freq_hz)), dtype=np.complex64)
    links[row[blocks.tx[of_pair, t], blocks.rx[of_pair, r]]] = weighed[of_pair, :, t, r].numpy()
    return links


#: Added to powers before their logarithm; pairs have a mean power of one per entry.
_FLOOR = 1e-3
_HIDDEN = 32


class PairAttention(nn.Module):
    """Weights of device pairs from what each says at a point and how far away it stands.

    Every feature has a head of its own. Over a narrow band all windows hear nearly the same; what
    then tells features apart is whom they listen to.
    """

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Linear(FEATURES + 2, _HIDDEN)
        self.last = nn.Linear(_HIDDEN, FEATURES)
        nn.init.normal_(self.last.weight)

    def forward(
        self, power: Float[Tensor, "pair N 32"], legs_m: Float[Tensor, "pair N 2"]
    ) -> Float[Tensor, "N 32"]:
        """Root of the attended mean power over pairs; untrained, heads differ at random.

        Args:
            power: |y|² of each pair, point and feature.
            legs_m: Distances from the transmitting and the receiving device [m].
        """
        tokens = torch.cat([torch.log(power + _FLOOR), torch.log(legs_m + _FLOOR)], dim=-1)
        score = self.last(torch.relu(self.first(tokens)))
        weight = torch.softmax(score, dim=0)
        # The root has no slope at zero.
        return torch.sqrt((weight * power).sum(dim=0) + 1e-12)
