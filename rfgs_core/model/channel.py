# SPDX-License-Identifier: Apache-2.0
"""The change of the channel that Gaussians cause, on chosen links and subcarriers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Complex, Int64
from torch import Tensor

from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.direct_path import direct_paths
from rfgs_core.measure.observations import Observations
from rfgs_core.model.head import RadioHead
from rfgs_core.propagation import (
    EnvironmentPaths,
    Links,
    Subcarriers,
    environment,
    propagate,
    shadow,
)
from rfgs_core.radio.constants import SPEED_OF_LIGHT


@dataclass(frozen=True)
class Channel:
    """Links, subcarriers and direct paths that Gaussians are compared on."""

    links: Links
    """Antenna pairs."""
    subcarriers: Subcarriers
    """Subcarriers."""
    paths: EnvironmentPaths
    """Direct paths of the links that leave their device."""
    tx: Int64[np.ndarray, "link"]
    """Transmitting element of each link."""
    rx: Int64[np.ndarray, "link"]
    """Receiving element of each link."""

    @staticmethod
    def of(
        observations: Observations,
        links: Bool[np.ndarray, "tx rx"],
        subcarriers: Bool[np.ndarray, "subcarrier"],
    ) -> Channel:
        """The marked links and subcarriers of a frame's radio."""
        tx, rx = np.nonzero(links)
        freq_hz = observations.freq_hz
        edges = np.flatnonzero(np.diff(np.concatenate([[0], subcarriers.astype(int), [0]])))
        blocks = tuple((int(a), int(b - a)) for a, b in zip(edges[::2], edges[1::2], strict=True))
        return Channel(
            links=Links(
                torch.from_numpy(observations.layout.tx_xyz[tx]),
                torch.from_numpy(observations.layout.rx_xyz[rx]),
            ),
            subcarriers=Subcarriers(
                float(freq_hz[0]), float(freq_hz[1] - freq_hz[0]), len(freq_hz), blocks
            ),
            paths=direct_paths(observations, links),
            tx=tx,
            rx=rx,
        )

    def rows(self, chosen: Int64[np.ndarray, "batch"]) -> Channel:
        """The channel of some of the links."""
        position = torch.full((len(self.links),), -1, dtype=torch.int64)
        position[torch.from_numpy(chosen)] = torch.arange(len(chosen))
        moved = position[self.paths.link]
        keep = moved >= 0
        return Channel(
            links=Links(self.links.tx_xyz[chosen], self.links.rx_xyz[chosen]),
            subcarriers=self.subcarriers,
            paths=replace(self.paths.rows(keep), link=moved[keep]),
            tx=self.tx[chosen],
            rx=self.rx[chosen],
        )

    def scattered(
        self, head: RadioHead, gaussians: Gaussians, gamma: Complex[Tensor, "M"] | None = None
    ) -> Complex[Tensor, "link subcarrier"]:
        """What the Gaussians reflect; `gamma` replaces the reflectivity of their features."""
        g = head.radio_gaussians(gaussians)
        strength = g.gamma if gamma is None else gamma[:, None]
        return propagate(replace(g, gamma=strength), self.links, self.subcarriers)

    def shadowed(self, head: RadioHead, gaussians: Gaussians) -> Complex[Tensor, "link subcarrier"]:
        """What the Gaussians take away from the direct paths: (T − 1) a (f_c/f) e^{−j2πfτ}.

        Free space weakens a path by λ/(4πd), so what is lost falls along the band (Friis).
        """
        if len(self.paths) == 0:
            size = len(self.links), self.subcarriers.num_selected
            return gaussians.means.new_zeros(size, dtype=torch.complex64)
        g = head.radio_gaussians(gaussians)
        passed = shadow(g.means, g.quats, g.scales, g.alpha, self.paths)
        lost = environment(passed - 1.0, self.paths, self.subcarriers, len(self.links))
        centre_hz = SPEED_OF_LIGHT / self.paths.wavelength_m
        weaker = (centre_hz / self.subcarriers.freq_hz).to(lost.device)
        return (lost * weaker).to(torch.complex64)

    def change(self, head: RadioHead, gaussians: Gaussians) -> Complex[Tensor, "link subcarrier"]:
        """Csi − csi_static: scattering plus shadow."""
        return self.scattered(head, gaussians) + self.shadowed(head, gaussians)
