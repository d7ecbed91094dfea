# SPDX-License-Identifier: Apache-2.0
"""The terms in which a predicted channel change is held against the reported one.

A radio reports the channel, powers per subcarrier or per delay, ratios or products; the model
predicts a complex change Δ. Each comparison turns Δ into what that radio would have reported.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import torch
from jaxtyping import Complex, Float, Float32, Int64
from torch import Tensor

from rfgs_core.measure.observations import Observations
from rfgs_core.measure.phase_free import direct_wave, reference_level
from rfgs_core.measure.relative import RULES, Relative
from rfgs_core.radio.delay import band_window


class Comparison(Protocol):
    """Measured entries of the visible links, in row-major order, and predicted ones."""

    @property
    def together(self) -> Int64[np.ndarray, "link"] | None:
        """Group of each link, of which a prediction needs all; None: each link by itself."""
        ...

    def measured(self) -> Tensor:
        """What the radio reports of the change, (link, entry)."""
        ...

    def predicted(
        self, change: Complex[Tensor, "batch subcarrier"], links: Int64[np.ndarray, "batch"]
    ) -> Tensor:
        """What it would report of a change on some of the links, visible subcarriers only."""
        ...

    def linear(self, change: Complex[Tensor, "link subcarrier"]) -> Tensor | None:
        """The part of `predicted` that is linear in the change, all links; None without one."""
        ...

    def residual(
        self, observations: Observations, change: Complex[Tensor, "link subcarrier"]
    ) -> Observations:
        """The observations less what the change of all links explains of them."""
        ...


class EachLink:
    """Links that can be compared one by one."""

    @property
    def together(self) -> None:
        """No groups."""
        return None


@dataclass(frozen=True)
class ComplexComparison(EachLink):
    """The channel itself."""

    target: Complex[Tensor, "link subcarrier"]
    """csi − csi_static."""

    def measured(self) -> Complex[Tensor, "link subcarrier"]:
        """The visible channel change."""
        return self.target

    def predicted(
        self, change: Complex[Tensor, "batch subcarrier"], links: Int64[np.ndarray, "batch"]
    ) -> Complex[Tensor, "batch subcarrier"]:
        """The change."""
        return change

    def linear(
        self, change: Complex[Tensor, "link subcarrier"]
    ) -> Complex[Tensor, "link subcarrier"]:
        """The change."""
        return change

    def residual(
        self, observations: Observations, change: Complex[Tensor, "link subcarrier"]
    ) -> Observations:
        """The residual channel."""
        return observations.with_entries((self.target - change).cpu().numpy())


@dataclass(frozen=True)
class PowerComparison(EachLink):
    """Change of power per subcarrier, in units of the reference's level."""

    target: Float[Tensor, "link subcarrier"]
    """(|H₀ + Δ|² − |H₀|²) / level."""
    empty: Complex[Tensor, "link subcarrier"]
    """Measured |H₀| on the computed phase of the direct path."""
    level: Float[Tensor, "link 1"]
    """RMS of |H₀|."""

    @staticmethod
    def of(observations: Observations) -> PowerComparison:
        """From the hologram, whose phase is that of the direct path."""
        links, subcarriers = observations.links, observations.subcarriers
        empty = observations.static[links][:, subcarriers]
        wave = direct_wave(observations.layout, observations.freq_hz)[links][:, subcarriers]
        target = (observations.delta[links][:, subcarriers] * wave.conj()).real
        # Hidden links are zero in `static`, so that the strongest one is a visible one.
        level = reference_level(np.abs(observations.static), subcarriers)[links][:, None]
        return PowerComparison(
            torch.from_numpy(target.astype(np.float32)),
            torch.from_numpy(empty.astype(np.complex64)),
            torch.from_numpy(level),
        )

    def measured(self) -> Float[Tensor, "link subcarrier"]:
        """Reported change of power over level."""
        return self.target

    def predicted(
        self, change: Complex[Tensor, "batch subcarrier"], links: Int64[np.ndarray, "batch"]
    ) -> Float[Tensor, "batch subcarrier"]:
        """(2 Re(H₀* Δ) + |Δ|²) / level."""
        cross = 2.0 * (self.empty[links].conj() * change).real
        return (cross + change.real**2 + change.imag**2) / self.level[links]

    def linear(self, change: Complex[Tensor, "link subcarrier"]) -> Float[Tensor, "link entry"]:
        """2 Re(H₀* Δ) / level."""
        return 2.0 * (self.empty.conj() * change).real / self.level

    def residual(
        self, observations: Observations, change: Complex[Tensor, "link subcarrier"]
    ) -> Observations:
        """The hologram of the residual."""
        residual = self.target - self.predicted(change, np.arange(len(self.target)))
        wave = direct_wave(observations.layout, observations.freq_hz)
        wave = wave[observations.links][:, observations.subcarriers]
        return observations.with_entries(residual.cpu().numpy() * wave)


@dataclass(frozen=True)
class DelayComparison(EachLink):
    """Amplitude of each link's delay profile."""

    target: Float32[Tensor, "link delay"]
    """||h| − |h₀||, see `phase_free`."""
    window: Float[Tensor, "subcarrier"]
    """Window of the visible subcarriers."""
    subcarriers: Int64[Tensor, "subcarrier"]
    """Places of the visible subcarriers in the band."""

    @staticmethod
    def of(observations: Observations) -> DelayComparison:
        """From the reported profiles."""
        assert observations.delay_change is not None
        return DelayComparison(
            torch.from_numpy(observations.delay_change[observations.links]),
            torch.from_numpy(band_window(observations.subcarriers)).float(),
            torch.from_numpy(np.flatnonzero(observations.subcarriers)),
        )

    def measured(self) -> Float32[Tensor, "link delay"]:
        """Reported change of the profiles' amplitude."""
        return self.target

    def predicted(
        self, change: Complex[Tensor, "batch subcarrier"], links: Int64[np.ndarray, "batch"]
    ) -> Float[Tensor, "batch delay"]:
        """|Δh(τ)| of the windowed band."""
        size = self.target.shape[1]
        band = change.new_zeros(len(change), size)
        band = band.index_copy(1, self.subcarriers, change * self.window[self.subcarriers])
        return torch.fft.ifft(band, dim=1, norm="forward").abs()

    def linear(self, change: Complex[Tensor, "link subcarrier"]) -> None:
        """An amplitude has no linear part."""
        return None

    def residual(
        self, observations: Observations, change: Complex[Tensor, "link subcarrier"]
    ) -> Observations:
        """Amplitudes above the predicted ones."""
        residual = self.target - self.predicted(change, np.arange(len(self.target)))
        delay_change = np.zeros((*observations.links.shape, residual.shape[1]), dtype=np.float32)
        delay_change[observations.links] = residual.clamp(min=0.0).cpu().numpy()
        return replace(observations, delay_change=delay_change)


@dataclass(frozen=True)
class RelativeComparison:
    """CSI ratios or conjugate products, as δ of `measure.relative`."""

    target: Complex[Tensor, "link subcarrier"]
    """δ."""
    empty: Complex[Tensor, "link subcarrier"]
    """The empty room on its direct paths."""
    pair: Int64[Tensor, "link"]
    """Device pair of each link."""
    kind: Relative
    """Which of both."""

    @staticmethod
    def of(observations: Observations, kind: Relative) -> RelativeComparison:
        """From δ and the empty room of the observations."""
        links, subcarriers = observations.links, observations.subcarriers
        rows = (x[links][:, subcarriers].copy() for x in (observations.delta, observations.static))
        pair = torch.from_numpy(observations.pairs[0][links])
        return RelativeComparison(*(torch.from_numpy(x) for x in rows), pair=pair, kind=kind)

    @property
    def together(self) -> Int64[np.ndarray, "link"]:
        """Links of one device pair: each is held against all of them."""
        return self.pair.cpu().numpy()

    def measured(self) -> Complex[Tensor, "link subcarrier"]:
        """δ of the frame."""
        return self.target

    def predicted(
        self, change: Complex[Tensor, "batch subcarrier"], links: Int64[np.ndarray, "batch"]
    ) -> Complex[Tensor, "batch subcarrier"]:
        """δ of e + Δ; `links` hold whole device pairs."""
        empty = self.empty[links]
        return RULES[self.kind][0](empty + change, empty, self.pair[links])

    def linear(
        self, change: Complex[Tensor, "link subcarrier"]
    ) -> Complex[Tensor, "link subcarrier"]:
        """The linear part of δ."""
        return RULES[self.kind][1](change, self.empty, self.pair)

    def residual(
        self, observations: Observations, change: Complex[Tensor, "link subcarrier"]
    ) -> Observations:
        """The δ that the change does not explain."""
        left = self.target - self.predicted(change, np.arange(len(self.target)))
        return observations.with_entries(left.cpu().numpy())


def comparison_of(observations: Observations) -> Comparison:
    """The comparison that suits what the radio reports."""
    if observations.kind == "power":
        return PowerComparison.of(observations)
    if observations.kind == "delay_power":
        return DelayComparison.of(observations)
    if observations.kind in ("csi_ratio", "conjugate"):
        return RelativeComparison.of(observations, observations.kind)
    links, subcarriers = observations.links, observations.subcarriers
    return ComplexComparison(torch.from_numpy(observations.delta[links][:, subcarriers].copy()))
