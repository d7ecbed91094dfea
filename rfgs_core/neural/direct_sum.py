# SPDX-License-Identifier: Apache-2.0
"""A channel as a plain complex sum over Gaussians, in the manner of nGRF.

After Umer, Mohsin, Bilal and Cioffi, "Neural Gaussian Radio Fields for Channel Estimation"
(arXiv 2508.11668): no rasteriser and no transparency, every Gaussian n adds its contribution c_n,
turned by the way from its centre to the receiver and weighted by its own bell at the receiver:

    H(r) = Σ_n c_n exp(−½ (r − μ_n)ᵀ Σ_n⁻¹ (r − μ_n)) e^{−jk|r − μ_n|} / |r − μ_n|.

What differs from the paper, so that one sum serves arrays and wide bands:

- Contributions are free numbers, one per Gaussian and group of links, where the paper has a network
  of the centre and the transmitter. They enter linearly, so they are solved by least squares in
  every step, and Adam moves centres and extents alone (variable projection, Golub and Pereyra, SIAM
  J. Numer. Anal. 10(2), 1973).
- The free-space decay 1/|r − μ_n| stands beside the bell, and where transmitters are given, so do
  the phase and the decay of the way from them: the paper's contributions are of one band and one
  place of the transmitter.
- Gaussians do not begin anywhere. In each round some are added where the loss would fall fastest
  with a contribution there: that gradient is the back-projection of what is not explained yet.
- The axes of a Gaussian are those of the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Complex128, Float64, Int64
from torch import Tensor

from rfgs_core.adam import Adam
from rfgs_core.encode.peaks import separated_peaks

#: Nearer than this no wave is followed [m].
NEAREST_M = 0.05
#: Looked at around the best places: so many others, so many wavelengths away.
_AROUND, _SHELLS = 64, (1.2, 0.5, 0.25)
#: Places that are looked at together.
_AT_ONCE = 2048

#: Draws so many places where Gaussians may begin [m].
Draw = Callable[[int, np.random.Generator], Float64[np.ndarray, "N 3"]]


class Links(NamedTuple):
    """Links whose antennas' places are known, one row each."""

    rx_xyz: Float64[Tensor, "link 3"]
    """Receivers [m]."""
    tx_xyz: Float64[Tensor, "link 3"] | None
    """Transmitters [m]; None where there is one, and contributions hold its way."""
    group: Int64[Tensor, "link"]
    """Which links share contributions, counted from zero."""
    wavenumber: Float64[Tensor, "subcarrier"]
    """2πf/c of each subcarrier [rad/m]."""

    def some(self, subcarriers: Int64[np.ndarray, "chosen"]) -> Links:
        """The same links at some subcarriers."""
        return self._replace(wavenumber=self.wavenumber[torch.from_numpy(subcarriers)])


@dataclass(frozen=True)
class SumSettings:
    """How many Gaussians, and how they are fitted."""

    rounds: int = 8
    """How often Gaussians are added."""
    per_round: int = 4
    """Gaussians of each round."""
    steps: int = 30
    """Adam steps after each round."""
    places: int = 20_000
    """Places that are looked at in each round."""
    tried: int = 64
    """The best of them, which are looked at more closely."""
    apart_m: float = 0.4
    """Least distance of Gaussians that are added together [m]."""
    rate: float = 0.08
    """Adam's rate of centres, in wavelengths; that of logarithms of extents is `extent_rate`."""
    extent_rate: float = 0.03
    """Adam's rate of logarithms of extents."""
    extent_m: float = 2.0
    """Standard deviation of a new Gaussian's bell [m]."""
    ridge: float = 0.02
    """Added to the normal equations of contributions, relative to their diagonal."""
    entries: int = 5000
    """Entries that a step looks at: all links, at subcarriers drawn anew in each round."""


@dataclass(frozen=True)
class DirectSum:
    """A fitted sum."""

    means: Float64[Tensor, "N 3"]
    """Centres [m]."""
    log_scales: Float64[Tensor, "N 3"]
    """Natural logarithm of the bells' standard deviations along x, y and z [m]."""
    contributions: Complex128[Tensor, "group N"]
    """What each adds to the links of a group."""

    def at(self, links: Links) -> Complex128[Tensor, "link subcarrier"]:
        """Channel of some links."""
        parts = []
        for rows in torch.arange(len(links.rx_xyz)).split(_AT_ONCE // 8):
            some = _rows(links, rows)
            terms = _terms(self.means, self.log_scales, some)
            parts.append(torch.einsum("lsn,ln->ls", terms, self.contributions[some.group]))
        return torch.cat(parts)

    def solved(
        self, links: Links, csi: Complex128[Tensor, "link subcarrier"], settings: SumSettings
    ) -> DirectSum:
        """The same Gaussians with contributions of other links."""
        terms = _terms(self.means, self.log_scales, links)
        return replace(self, contributions=_solved(terms, links, csi, settings.ridge))

    def heard(self, links: Links) -> Float64[Tensor, "N"]:
        """Mean over links of |c|² as the bells let it through."""
        way = links.rx_xyz[:, None] - self.means
        bell = torch.exp(-(((way / torch.exp(self.log_scales)) ** 2).sum(dim=2)))
        return (bell * self.contributions[links.group].abs() ** 2).mean(dim=0)


def fit_direct_sum(
    links: Links,
    csi: Complex128[Tensor, "link subcarrier"],
    draw: Draw,
    settings: SumSettings,
    rng: np.random.Generator,
    first: Float64[np.ndarray, "known 3"] | None = None,
) -> DirectSum:
    """Adds Gaussians round by round, and moves all of them after each.

    Args:
        links: Links that are heard.
        csi: Their channel.
        draw: Where Gaussians may begin.
        settings: How many, and how.
        rng: Draws places and subcarriers.
        first: Places of Gaussians that are there from the start [m].

    Returns:
        The sum, its contributions solved from every entry.
    """
    level = float(csi.abs().pow(2).mean().sqrt()) or 1.0
    csi = csi / level
    means = torch.from_numpy(np.zeros((0, 3)) if first is None else np.asarray(first, np.float64))
    found = DirectSum(means, _wide(len(means), settings), csi.new_zeros(0, 0))
    for _ in range(settings.rounds):
        subcarriers = _drawn(links, settings, rng)
        part, heard = links.some(subcarriers), csi[:, torch.from_numpy(subcarriers)]
        new = _places(found, part, heard, draw, settings, rng)
        means = torch.cat([found.means, torch.from_numpy(new)])
        scales = torch.cat([found.log_scales, _wide(len(new), settings)])
        found = _descend(DirectSum(means, scales, found.contributions), part, heard, settings)
    return found.solved(links, level * csi, settings)


def _wide(count: int, settings: SumSettings) -> Float64[Tensor, "N 3"]:
    return torch.full((count, 3), float(np.log(settings.extent_m)), dtype=torch.float64)


def _rows(links: Links, rows: Int64[Tensor, "some"]) -> Links:
    sent = None if links.tx_xyz is None else links.tx_xyz[rows]
    return Links(links.rx_xyz[rows], sent, links.group[rows], links.wavenumber)


def _drawn(
    links: Links, settings: SumSettings, rng: np.random.Generator
) -> Int64[np.ndarray, "chosen"]:
    """Subcarriers of a round, so that a step looks at about `settings.entries`."""
    among = len(links.wavenumber)
    count = min(max(settings.entries // max(len(links.rx_xyz), 1), 4), among)
    return np.sort(rng.choice(among, count, replace=False))


def _terms(
    means: Float64[Tensor, "N 3"], log_scales: Float64[Tensor, "N 3"] | None, links: Links
) -> Complex128[Tensor, "link subcarrier N"]:
    """What a contribution of one would add; without extents, of bells that are one everywhere."""
    way = links.rx_xyz[:, None] - means
    path = torch.linalg.norm(way, dim=2).clamp(min=NEAREST_M)
    size = 1.0 / path
    if log_scales is not None:
        size = size * torch.exp(-0.5 * ((way / torch.exp(log_scales)) ** 2).sum(dim=2))
    if links.tx_xyz is not None:
        sent = torch.linalg.norm(links.tx_xyz[:, None] - means, dim=2).clamp(min=NEAREST_M)
        path, size = path + sent, size / sent
    phase = -path[:, None] * links.wavenumber[:, None]
    return torch.polar(size[:, None].expand_as(phase).contiguous(), phase)


def _solved(
    terms: Complex128[Tensor, "link subcarrier N"],
    links: Links,
    csi: Complex128[Tensor, "link subcarrier"],
    ridge: float,
) -> Complex128[Tensor, "group N"]:
    """Contributions of each group by least squares, drawn to zero a little."""
    rows = []
    for group in range(int(links.group.max()) + 1):
        own = links.group == group
        columns = terms[own].reshape(-1, terms.shape[2])
        gram = columns.conj().T @ columns
        diagonal = torch.diagonal(gram).real.clamp(min=1e-300)
        gram = gram + torch.diag(ridge * diagonal).to(gram.dtype)
        rows.append(torch.linalg.solve(gram, columns.conj().T @ csi[own].reshape(-1)))
    return torch.stack(rows)


def _descend(
    found: DirectSum,
    links: Links,
    csi: Complex128[Tensor, "link subcarrier"],
    settings: SumSettings,
) -> DirectSum:
    """Moves centres and extents down the error that the best contributions leave.

    These are held in the gradient: where they are the best ones, it does not see them.
    """
    means = found.means.clone().requires_grad_()
    log_scales = found.log_scales.clone().requires_grad_()
    wavelength_m = 2.0 * np.pi / float(links.wavenumber.mean())
    optimiser = Adam({means: settings.rate * wavelength_m, log_scales: settings.extent_rate})
    for _ in range(settings.steps):
        terms = _terms(means, log_scales, links)
        with torch.no_grad():
            solved = _solved(terms, links, csi, settings.ridge)
        predicted = torch.einsum("lsn,ln->ls", terms, solved[links.group])
        loss = ((csi - predicted).abs() ** 2).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    moved = replace(found, means=means.detach(), log_scales=log_scales.detach())
    return moved.solved(links, csi, settings)


def _places(
    found: DirectSum,
    links: Links,
    csi: Complex128[Tensor, "link subcarrier"],
    draw: Draw,
    settings: SumSettings,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "new 3"]:
    """Where contributions would lower the error most, looked for ever more closely."""
    left = csi
    if len(found.means):
        left = csi - found.solved(links, csi, settings).at(links)
    points = draw(settings.places, rng)
    gain, apart_m = _explained(points, links, left), settings.apart_m / 2.0
    best = separated_peaks(points, gain, settings.tried, apart_m)
    if not best:
        return points[:0]
    tried, gain = points[best], gain[best]
    wavelength_m = 2.0 * np.pi / float(links.wavenumber.mean())
    for shell in _SHELLS:
        near = rng.normal(size=(len(tried), _AROUND, 3)) * shell * wavelength_m
        near[:, 0] = 0.0
        near += tried[:, None]
        explained = _explained(near.reshape(-1, 3), links, left).reshape(near.shape[:2])
        tried = near[np.arange(len(tried)), explained.argmax(axis=1)]
        gain = explained.max(axis=1)
    return tried[separated_peaks(tried, gain, settings.per_round, settings.apart_m)]


def _explained(
    points: Float64[np.ndarray, "N 3"],
    links: Links,
    left: Complex128[Tensor, "link subcarrier"],
) -> Float64[np.ndarray, "N"]:
    """Power of a residual that one Gaussian at each place could take away, all groups together."""
    parts = []
    for part in torch.from_numpy(points).split(_AT_ONCE):
        terms = _terms(part, None, links).to(torch.complex64)
        total = terms.real.new_zeros(len(part))
        for group in range(int(links.group.max()) + 1):
            own = links.group == group
            columns = terms[own].reshape(-1, len(part))
            answer = columns.conj().T @ left[own].reshape(-1).to(torch.complex64)
            total = total + answer.abs() ** 2 / (columns.abs() ** 2).sum(dim=0)
        parts.append(total)
    return torch.cat(parts).double().numpy()
