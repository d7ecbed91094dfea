# SPDX-License-Identifier: Apache-2.0
"""Three-layer networks (→ 64 → 32 → 32, paper section 3.2) that weigh a channel 32 times over.

| network | radio | convolves | sees |
|---|---|---|---|
| csi | Wi-Fi | 2D: receiving antennas × subcarriers | amplitude, unwrapped phase |
| cube | mmWave | 3D: range × angle of departure × angle of arrival | range–angle cube |
| doppler | mmWave, several chirps | 3D: Doppler × arrival × range | range–Doppler–angle cube |
| range | UWB | 1D: range | range profile of each link |

Output c is the channel times the network's weight c (between 0 and 2; in the network's own
domain) and times a Hamming window over a quarter of the band centred on part c of 32, so that
features stay ordered by frequency and keep range resolution. Untrained, every weight is 1.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from itertools import pairwise
from typing import Literal

import torch
from jaxtyping import Bool, Complex, Float, Int64
from torch import Tensor, nn

from rfgs_core.encode.learned.blocks import Blocks
from rfgs_core.encode.preprocess import hamming, unwrap_phase
from rfgs_core.encode.protocol import FEATURES, FrameChannel
from rfgs_core.radio.presets import ULTRA_WIDE_BAND

NetworkKind = Literal["csi", "cube", "doppler", "range"]

#: Channels after each layer (paper section 3.2).
LAYERS = (64, 32, FEATURES)
#: Width of the window of each feature, as a share of the band.
WINDOW_SHARE = 0.25
#: Most Doppler frequencies that are weighed apart; finer ones share a weight.
DOPPLER_BANDS = 16


def feature_windows(freq_hz: Float[Tensor, "subcarrier"]) -> Float[Tensor, "32 subcarrier"]:
    """Hamming windows centred on equal parts of the band, each of mean square one."""
    subcarriers = freq_hz.numpy()
    spacing_hz = subcarriers[1] - subcarriers[0]
    width_hz = spacing_hz * len(subcarriers)
    rows = []
    for part in range(FEATURES):
        centre_hz = subcarriers[0] - 0.5 * spacing_hz + (part + 0.5) / FEATURES * width_hz
        row = torch.from_numpy(hamming(subcarriers, centre_hz, WINDOW_SHARE * width_hz))
        rows.append(row / row.square().mean().sqrt())
    return torch.stack(rows).float()


class Gates(nn.Module, ABC):
    """Base of the networks: `weigh` is theirs, windows and hidden entries are common."""

    def __init__(self, convolution: type[nn.Module], kernel: int | tuple[int, ...]) -> None:
        super().__init__()
        sizes = (3, *LAYERS)
        layers: list[nn.Module] = []
        for before, after in pairwise(sizes):
            layers += [convolution(before, after, kernel, padding="same"), nn.ReLU()]
        self.layers = nn.Sequential(*layers[:-1])
        last = self.layers[-1]
        nn.init.zeros_(last.weight)  # type: ignore[arg-type]
        nn.init.zeros_(last.bias)  # type: ignore[arg-type]

    def gates(self, picture: Float[Tensor, "batch 3 *axes"]) -> Float[Tensor, "batch 32 *axes"]:
        """Weights between 0 and 2."""
        return 2.0 * torch.sigmoid(self.layers(picture))

    @abstractmethod
    def weigh(self, blocks: Blocks) -> Complex[Tensor, "pair 32 tx rx subcarrier"]:
        """The channel times the weights."""

    def forward(self, blocks: Blocks) -> Complex[Tensor, "pair 32 tx rx subcarrier"]:
        """The channel as each of the 32 features reads it; hidden entries stay silent."""
        window = feature_windows(blocks.freq_hz)[:, None, None, :]
        return self.weigh(blocks) * window * blocks.visible[:, None]


class CsiGates(Gates):
    """Wi-Fi: amplitude and unwrapped phase over antennas and subcarriers."""

    def __init__(self) -> None:
        super().__init__(nn.Conv2d, 3)

    def weigh(self, blocks: Blocks) -> Complex[Tensor, "pair 32 tx rx subcarrier"]:
        """Weights per antenna and subcarrier."""
        picture = csi_picture(blocks.csi, blocks.visible, blocks.freq_hz)
        gates = self.gates(picture.flatten(0, 1)).unflatten(0, blocks.csi.shape[:2])
        return gates.transpose(1, 2) * blocks.csi[:, None]


class CubeGates(Gates):
    """MmWave: the range–angle cube of a device pair with linear arrays."""

    def __init__(self) -> None:
        super().__init__(nn.Conv3d, 3)

    def weigh(self, blocks: Blocks) -> Complex[Tensor, "pair 32 tx rx subcarrier"]:
        """Weights per cell of the cube; the weighed one is turned back to antennas, subcarriers."""
        window = _band_window(blocks.freq_hz)
        gates = self.gates(_parts(_cube(blocks.csi * window)))
        cube = gates * _cube(blocks.csi)[:, None]
        return torch.fft.fft(torch.fft.fftn(cube, dim=(2, 3), norm="ortho"), norm="ortho")


class DopplerGates(Gates):
    """MmWave with several chirps per frame: the range–Doppler–angle cube of a device pair.

    Whoever moves is met at Dopplers of his own, and the residual of the empty room at zero.
    Directions of departure share their weights: a cube of four axes has no convolution that a
    processor takes in its stride.
    """

    def __init__(self) -> None:
        super().__init__(nn.Conv3d, 3)

    def weigh(self, blocks: Blocks) -> Complex[Tensor, "pair 32 tx rx subcarrier"]:
        """Weights per cell; the weighed cube is turned back to the first packet."""
        assert blocks.packets is not None
        time = torch.hamming_window(blocks.packets.shape[1], periodic=False)[:, None, None, None]
        shown = _doppler_cube(blocks.packets * _band_window(blocks.freq_hz) * time)
        gates = self.gates(doppler_picture(shown))
        bands = _bands(shown.shape[1])
        cube = _doppler_cube(blocks.packets)
        # At the first packet all Dopplers simply add.
        parts = cube.new_zeros((cube.shape[0], int(bands[-1]) + 1, *cube.shape[2:]))
        parts = parts.index_add(1, bands, cube) / cube.shape[1] ** 0.5
        first = torch.einsum("pcbar,pbdar->pcdar", gates.to(parts.dtype), parts)
        return torch.fft.fft(torch.fft.fftn(first, dim=(2, 3), norm="ortho"), norm="ortho")


class RangeGates(Gates):
    """UWB: the range profile of each link."""

    def __init__(self) -> None:
        super().__init__(nn.Conv1d, 5)

    def weigh(self, blocks: Blocks) -> Complex[Tensor, "pair 32 tx rx subcarrier"]:
        """Weights per delay; the weighed profile is turned back to subcarriers."""
        window = _band_window(blocks.freq_hz)
        picture = _parts(torch.fft.ifft(blocks.csi * window, norm="ortho"))
        links = picture.permute(0, 2, 3, 1, 4)
        gates = self.gates(links.flatten(0, 2)).unflatten(0, links.shape[:3])
        profile = torch.fft.ifft(blocks.csi, norm="ortho")
        return torch.fft.fft(gates.permute(0, 3, 1, 2, 4) * profile[:, None], norm="ortho")


def csi_picture(
    csi: Complex[Tensor, "pair tx rx subcarrier"],
    visible: Bool[Tensor, "pair tx rx subcarrier"],
    freq_hz: Float[Tensor, "subcarrier"],
) -> Float[Tensor, "pair tx 3 rx subcarrier"]:
    """Amplitude, phase in half turns less its bulk slope, and what is visible.

    The phase is unwrapped over the visible subcarriers of each link at their own frequencies, and
    zero elsewhere.
    """
    phase = torch.zeros(csi.shape, dtype=torch.float64)
    shown = visible.flatten(0, 2).any(dim=0).numpy()
    if shown.sum() > 1:
        subcarriers = freq_hz.numpy()[shown]
        unwrapped, slope = unwrap_phase(csi[..., shown].numpy(), subcarriers)
        line = slope[..., None] * (subcarriers - subcarriers[0])
        phase[..., shown] = torch.from_numpy((unwrapped - line) / torch.pi)
    return torch.stack([csi.abs(), (phase * visible).float(), visible.float()], dim=2)


def _doppler_cube(
    packets: Complex[Tensor, "pair packet tx rx subcarrier"],
) -> Complex[Tensor, "pair doppler departure arrival range"]:
    """Range–Doppler–angle cube, Dopplers ascending, that of nothing in the middle."""
    doppler = torch.fft.fftshift(torch.fft.fft(packets, dim=1, norm="ortho"), dim=1)
    return torch.fft.ifftn(doppler, dim=(2, 3, 4), norm="ortho")


def _bands(packets: int) -> Int64[Tensor, "doppler"]:
    """Which of at most `DOPPLER_BANDS` each Doppler frequency belongs to."""
    return torch.arange(packets) * min(packets, DOPPLER_BANDS) // packets


def doppler_picture(
    cube: Complex[Tensor, "pair doppler departure arrival range"],
) -> Float[Tensor, "pair 3 band arrival range"]:
    """RMS and largest amplitude of each band over departures, and the band's Doppler frequency.

    The frequency, −1 to 1, is what a convolution cannot know: it sees every place alike.
    """
    bands = _bands(cube.shape[1])
    count = int(bands[-1]) + 1
    amplitude = cube.abs()
    loudest = torch.stack(
        [amplitude[:, bands == band].amax(dim=(1, 2)) for band in range(count)], 1
    )
    power = torch.stack(
        [amplitude[:, bands == band].square().mean(dim=(1, 2)) for band in range(count)], 1
    )
    frequency = torch.linspace(-1.0, 1.0, count)[:, None, None].expand_as(power)
    return torch.stack([power.sqrt(), loudest, frequency], dim=1)


def _band_window(freq_hz: Float[Tensor, "subcarrier"]) -> Float[Tensor, "subcarrier"]:
    """Hamming window over the whole band."""
    subcarriers = freq_hz.numpy()
    return torch.from_numpy(
        hamming(subcarriers, subcarriers.mean(), subcarriers[-1] - subcarriers[0])
    ).float()


def _cube(
    csi: Complex[Tensor, "pair tx rx subcarrier"],
) -> Complex[Tensor, "pair departure arrival range"]:
    """Range–angle cube: directions of the two linear arrays, and delays."""
    return torch.fft.ifftn(torch.fft.ifft(csi, norm="ortho"), dim=(1, 2), norm="ortho")


def _parts(values: Complex[Tensor, "pair *axes"]) -> Float[Tensor, "pair 3 *axes"]:
    """Real part, imaginary part and amplitude."""
    return torch.stack([values.real, values.imag, values.abs()], dim=1)


NETWORKS: dict[NetworkKind, Callable[[], Gates]] = {
    "csi": CsiGates,
    "cube": CubeGates,
    "doppler": DopplerGates,
    "range": RangeGates,
}


def network_for(seen: FrameChannel) -> NetworkKind:
    """The network of a kind of radio: bandwidth, who hears whom, and a radar's packets decide."""
    freq_hz = seen.freq_hz
    if (freq_hz[-1] - freq_hz[0]) / freq_hz.mean() > ULTRA_WIDE_BAND:
        return "range"
    if seen.monostatic:
        return "cube" if seen.packets is None else "doppler"
    return "csi"
