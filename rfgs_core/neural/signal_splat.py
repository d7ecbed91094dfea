# SPDX-License-Identifier: Apache-2.0
"""What a receiver hears from each direction, splatted from Gaussians whose signals a network tells.

After Wen, Tong, Hu, Lin and Zhang, "WRF-GS: Wireless Radiation Field Reconstruction with 3D
Gaussian Splatting" (arXiv 2412.04832). A network reads the centre μ_n of a Gaussian and gives how
much it lets through; with the place t of the transmitter it gives the signal S_n(t) that comes from
there. Seen from the receiver, Gaussians are bells on the sphere of directions u, nearest first:

    I(u; t) = Σ_n S_n(t) w_n(u),    w_n(u) = α_n g_n(u) Π_{m nearer} (1 − α_m g_m(u)).

There is a field for each receiving array. What differs from the paper:

- The paper's spatial spectra are powers. Here S is complex and turns with the known way from the
  transmitter over the Gaussian to the array, e^{−jk(|t − μ| + |μ − r|)} / (|t − μ| |μ − r|), so
  that delays are right at every subcarrier. An element hears the sum over all directions, each
  turned as a plane wave, H(x) = Σ_u I(u) e^{jk u·(x − r)}, with k in the middle of the band.
- Pixels are equal steps of azimuth and elevation, and bells round; a bell is never narrower than
  half a pixel. The paper projects by Mercator, with bells of any shape.
- The number of Gaussians stays as it is: they start where the matched filter answers, or anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Complex64, Float, Float32, Float64
from torch import Tensor, nn

from rfgs_core.neural.direct_sum import NEAREST_M
from rfgs_core.neural.encodings import positional
from rfgs_core.neural.fields import perceptron

#: Octaves of sines that the network reads of a place, and what it tells of one to itself.
_OCTAVES, _FEATURES = 4, 32
#: A Gaussian hides at most this share of what is behind it.
_MOST_HIDDEN = 0.99


@dataclass(frozen=True)
class SplatSettings:
    """How many Gaussians, and how they are fitted."""

    gaussians: int = 300
    """Gaussians of each receiving array."""
    pixel_deg: float = 6.0
    """Step of azimuth and elevation, a part of 180 [degrees]."""
    reach_deg: float = 24.0
    """Pixels farther from all first directions of Gaussians are left out [degrees]."""
    width: int = 64
    """Width of the network's layers."""
    scale_m: float = 0.08
    """Standard deviation of a Gaussian at the start [m]."""
    steps: int = 100
    """Adam steps."""
    transmitters: int = 64
    """Places of the transmitter that a step looks at, at most."""
    subcarriers: int = 8
    """Subcarriers that a step looks at, at most."""
    rate: float = 3e-3
    """Adam's rate of the network at the start; all rates fall to a tenth."""
    place_rate_m: float = 1e-3
    """Adam's rate of centres [m]; that of logarithms of scales is `rate`."""


def directions(pixel_deg: float) -> Float32[Tensor, "pixel 3"]:
    """Unit vectors of all pixels: rows of equal elevation from below, equal steps of azimuth."""
    elevation = np.radians(np.arange(-90.0 + pixel_deg / 2, 90.0, pixel_deg))
    azimuth = np.radians(np.arange(-180.0 + pixel_deg / 2, 180.0, pixel_deg))
    up, around = (part.ravel() for part in np.meshgrid(elevation, azimuth, indexing="ij"))
    flat = np.cos(up)
    unit = np.stack([flat * np.cos(around), flat * np.sin(around), np.sin(up)], axis=1)
    return torch.from_numpy(unit).float()


def _near(
    pixels: Float32[Tensor, "pixel 3"], ways: Float64[np.ndarray, "N 3"], reach_deg: float
) -> Float32[Tensor, "near 3"]:
    """Pixels within reach of any of some directions; all others stay dark, and cost time."""
    unit = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), NEAREST_M)
    cosine = pixels @ torch.from_numpy(unit).float().T
    return pixels[cosine.max(dim=1).values >= np.cos(np.radians(reach_deg))]


class SignalSplat(nn.Module):
    """Gaussians around one receiving array, and the network of their signals."""

    def __init__(
        self,
        means: Float64[np.ndarray, "N 3"],
        receiver: Float64[np.ndarray, "3"],
        bounds_m: Float64[np.ndarray, "2 3"],
        settings: SplatSettings,
        seed: int,
    ) -> None:
        """Gaussians at some places [m]; weights of the network depend on the seed alone.

        Args:
            means: Centres at the start [m].
            receiver: Middle of the array [m].
            bounds_m: What the network takes for the extent of places [m].
            settings: Size of everything.
            seed: Draws the weights.
        """
        super().__init__()
        low, high = torch.from_numpy(np.asarray(bounds_m))
        self.settings = settings
        self.middle, self.half_m = (low + high) / 2.0, float((high - low).max()) / 2.0
        self.receiver = torch.from_numpy(np.asarray(receiver, np.float64))
        self.pixels = _near(directions(settings.pixel_deg), means - receiver, settings.reach_deg)
        self.means = nn.Parameter(torch.from_numpy(np.array(means, np.float64)))
        log_scale = float(np.log(settings.scale_m))
        self.log_scales = nn.Parameter(torch.full((len(means),), log_scale))
        generator = torch.Generator().manual_seed(seed % (1 << 63))
        size, width = 3 * (1 + 2 * _OCTAVES), settings.width
        self.matter = perceptron(size, width, 2, 1 + _FEATURES, generator)
        self.signal = perceptron(_FEATURES + 2 * size + 1, width, 2, 2, generator)
        #: What all signals are multiplied by, so that the first ones are as loud as the measured.
        self.gain = 1.0

    def weights(self) -> tuple[Float[Tensor, "pixel N"], Float[Tensor, "N 32"]]:
        """Share w of each Gaussian in each pixel, and what the network says of its place."""
        read = self.matter(positional(self._unit(self.means), _OCTAVES))
        way = (self.means - self.receiver).float()
        distance = torch.linalg.norm(way, dim=1).clamp(min=NEAREST_M)
        narrowest = np.radians(self.settings.pixel_deg) / 2.0
        variance = (torch.exp(self.log_scales) / distance) ** 2 + narrowest**2
        cosine = self.pixels @ (way / distance[:, None]).T
        # 2 (1 − cos a) is a² for small angles, and has no pole.
        bell = torch.exp(-(1.0 - cosine) / variance)
        hidden = torch.sigmoid(read[:, 0]) * bell * _MOST_HIDDEN
        order = torch.argsort(distance)
        passed = torch.log1p(-hidden[:, order])
        passed = torch.exp(torch.cumsum(passed, dim=1) - passed)
        return (hidden[:, order] * passed)[:, torch.argsort(order)], read[:, 1:]

    def signals(
        self, features: Float[Tensor, "N 32"], tx: Float64[Tensor, "tx 3"]
    ) -> Complex64[Tensor, "tx N"]:
        """Signal of each Gaussian for some places of the transmitter, without its ways."""
        shape = (len(tx), len(features))
        apart = ((tx[:, None] - self.means) / self.half_m).float()
        parts = (
            features.expand(*shape, -1),
            positional(self._unit(tx), _OCTAVES)[:, None].expand(*shape, -1),
            positional(apart.reshape(-1, 3), _OCTAVES).reshape(*shape, -1),
            torch.linalg.norm(apart, dim=2, keepdim=True),
        )
        out = self.signal(torch.cat(parts, dim=2).flatten(0, 1)).reshape(*shape, 2)
        return self.gain * torch.view_as_complex(out.contiguous())

    def ways(
        self, tx: Float64[Tensor, "tx 3"], wavenumber: Float64[Tensor, "subcarrier"]
    ) -> Complex64[Tensor, "tx N subcarrier"]:
        """Decay and turn from transmitters over each Gaussian to the middle of the array."""
        sent = torch.linalg.norm(tx[:, None] - self.means, dim=2).clamp(min=NEAREST_M)
        heard = torch.linalg.norm(self.receiver - self.means, dim=1).clamp(min=NEAREST_M)
        # In double precision to here: a phase is thousands of radians at 60 GHz.
        phase = -(sent + heard)[..., None] * wavenumber
        size = (1.0 / (sent * heard))[..., None].expand_as(phase).contiguous()
        return torch.polar(size, phase).to(torch.complex64)

    def channel(
        self,
        tx: Float64[Tensor, "tx 3"],
        elements: Float64[Tensor, "rx 3"],
        wavenumber: Float64[Tensor, "subcarrier"],
        middle: float,
    ) -> Complex64[Tensor, "tx rx subcarrier"]:
        """What elements of the array hear.

        Args:
            tx: Transmitters [m].
            elements: Elements of the array [m].
            wavenumber: 2πf/c of some subcarriers [rad/m].
            middle: The same in the middle of the band, for the array.
        """
        share, features = self.weights()
        turn = middle * (elements - self.receiver).float() @ self.pixels.T
        steering = torch.polar(torch.ones_like(turn), turn) @ share.to(torch.complex64)
        heard = self.signals(features, tx)[..., None] * self.ways(tx, wavenumber)
        return torch.einsum("rn,tns->trs", steering, heard)

    def spectra(self, tx: Float64[Tensor, "tx 3"]) -> Float[Tensor, "tx pixel"]:
        """Amplitude from every direction: the paper's spatial spectrum, without any ways."""
        share, features = self.weights()
        return (self.signals(features, tx) @ share.T.to(torch.complex64)).abs()

    def _unit(self, places: Float64[Tensor, "N 3"]) -> Float32[Tensor, "N 3"]:
        return ((places - self.middle) / self.half_m).float()
