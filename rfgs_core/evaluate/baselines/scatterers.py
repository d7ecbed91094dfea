# SPDX-License-Identifier: Apache-2.0
"""Point scatterers, coherent within a device pair: the model behind CLEAN, OMP, FISTA and MUSIC.

ΔH[t, r, f] = Σ_i a_i(pair) exp(−j 2π f (|p_i − x_t| + |p_i − x_r|) / c)
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Complex64, Float, Float32, Int64

from rfgs_core.encode.matched_filter import matched_filter
from rfgs_core.evaluate.evidence import BaselineResult, Evidence
from rfgs_core.evaluate.grid import Grid, splat_gaussians
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Standard deviation of the round beam each point is shown with [m].
BEAM_M = 0.06


class PointModel:
    """Steering vectors, back-projection and prediction of one frame's evidence."""

    def __init__(self, evidence: Evidence) -> None:
        self.evidence = evidence
        layout = evidence.layout
        self.layout = layout
        self.pair, self.pairs = layout.pairs_of(evidence.link_visible)
        self.subcarriers = np.flatnonzero(evidence.subcarrier_visible)
        self.wavenumber = 2.0 * np.pi * evidence.freq_hz / SPEED_OF_LIGHT
        self.links = [np.nonzero(self.pair == index) for index in range(len(self.pairs))]

    def measurements(self) -> list[Complex[np.ndarray, "link subcarrier"]]:
        """Visible csi − csi_static per pair."""
        return [self.evidence.delta[tx, rx][:, self.subcarriers] for tx, rx in self.links]

    def steering(
        self, point: Float[np.ndarray, "3"], pair: int
    ) -> Complex[np.ndarray, "link subcarrier"]:
        """Unit phasors of one point on the visible entries of a pair."""
        tx, rx = self.links[pair]
        return self._phasor(point, tx, rx)[:, self.subcarriers]

    def phasors(
        self,
        points: Float[np.ndarray, "N 3"],
        pair: int,
        subcarriers: Int64[np.ndarray, "chosen"] | None = None,
    ) -> Complex64[np.ndarray, "link chosen N"]:
        """Unit phasors of many points on a pair's links, at its visible subcarriers by default."""
        tx, rx = self.links[pair]
        chosen = self.subcarriers if subcarriers is None else subcarriers
        length = np.linalg.norm(self.layout.tx_xyz[tx][:, None] - points, axis=2)
        length = length + np.linalg.norm(self.layout.rx_xyz[rx][:, None] - points, axis=2)
        # In double precision to here: a phase is thousands of radians at 60 GHz.
        turns = length[:, None] * (self.wavenumber[chosen] / (2.0 * np.pi))[:, None]
        phase = (-2.0 * np.pi * (turns - np.rint(turns))).astype(np.float32)
        # Four times quicker than the exponential of a complex number.
        out = np.zeros(phase.shape, dtype=np.complex64)
        out.real, out.imag = np.cos(phase), np.sin(phase)
        return out

    def _phasor(
        self, point: Float[np.ndarray, "3"], tx: np.ndarray, rx: np.ndarray
    ) -> Complex[np.ndarray, "link subcarrier"]:
        length = np.linalg.norm(self.layout.tx_xyz[tx] - point, axis=1)
        length = length + np.linalg.norm(self.layout.rx_xyz[rx] - point, axis=1)
        return np.exp(-1j * length[:, None] * self.wavenumber).astype(np.complex64)

    def back_project(
        self,
        residual: list[Complex[np.ndarray, "link subcarrier"]],
        points: Float[np.ndarray, "N 3"],
    ) -> Complex[np.ndarray, "pair N"]:
        """Mean of residual times conjugate steering per pair: the best amplitude of each point."""
        full = np.zeros(self.evidence.delta.shape, dtype=np.complex64)
        for (tx, rx), values in zip(self.links, residual, strict=True):
            full[tx[:, None], rx[:, None], self.subcarriers[None, :]] = values
        answer = matched_filter(full, self.layout, self.pair, self.evidence.freq_hz, points)[:, 0]
        # The filter divides by all subcarriers; hidden ones are zero here.
        return answer * (full.shape[2] / len(self.subcarriers))

    def spreading(self, points: Float[np.ndarray, "N 3"], a: int, b: int) -> np.ndarray:
        """d_t · d_r between points and the arrays of a device pair [m²], shape (N,)."""
        tx, rx = self.layout.centres_of(a, b)
        return np.linalg.norm(points - tx, axis=1) * np.linalg.norm(points - rx, axis=1)

    def result(
        self,
        points: Float[np.ndarray, "N 3"],
        amplitude: Complex[np.ndarray, "pair N"],
        power: Float[np.ndarray, "N"] | None = None,
    ) -> BaselineResult:
        """Score and channel of a set of points; `power` is what the score shows.

        By default that is their mean reflectivity. A pair of devices that was never seen gets the
        mean reflectivity of the seen ones and an arbitrary phase of zero.
        """
        spread = np.stack([self.spreading(points, a, b) for a, b in self.pairs])
        reflectivity = np.sqrt(np.mean(np.abs(amplitude * spread) ** 2, axis=0))
        score = shown(self.evidence.grid, points, reflectivity**2 if power is None else power)
        layout = self.layout
        delta = np.zeros(self.evidence.delta.shape, dtype=np.complex64)
        for a, b in layout.device_pairs:
            tx, rx = np.nonzero(layout.links_between(a, b) & layout.measured)
            if (a, b) in self.pairs:
                gain = amplitude[self.pairs.index((a, b))]
            else:
                gain = reflectivity / self.spreading(points, a, b)
            for point, value in zip(points, gain, strict=True):
                delta[tx, rx] += value * self._phasor(point, tx, rx)
        return BaselineResult(score=score, delta=delta)


def shown(
    grid: Grid, points: Float[np.ndarray, "N 3"], power: Float[np.ndarray, "N"]
) -> Float32[np.ndarray, "x y z"]:
    """Score of points [m] and their powers, each with a round beam."""
    beams = np.repeat(BEAM_M**2 * np.eye(3)[None], len(points), axis=0)
    return splat_gaussians(grid, points, beams, power)
