# SPDX-License-Identifier: Apache-2.0
"""Delay–angle power maps, and what they are expected to be of Gaussians, without any phases.

For a device pair the channel is turned into power over delay and arrival direction. The
expected map is a sum over Gaussians, whose phases are independent and uniform,

    E[m(τ, s)] = Σ_i p_i v_i g_i |r(τ − τ_i)|² |b(s, u_i)|²,

with the pulse r of the windowed band, the beam b of the array, the two-leg spreading
g = (λ / ((4π)^{3/2} d_t d_r))², and the visibility v_i of a Gaussian that faces away. No carrier
phase enters, hence clocks and millimetre errors of position do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Float64

from rfgs_core.measure.observations import Observations
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import band_window, delay_profile

#: Delay samples and beams per resolution cell.
OVERSAMPLING = 2
#: Beams point up to this sine away from broadside.
WIDEST_SINE = 0.95
#: An aperture of more beams than this has no far field in a room. Places that an antenna takes in
#: turn are then split into runs that are no wider than so many wavelengths, a map each.
MOST_BEAMS, RUN_WAVELENGTHS = 4096, 8.0


@dataclass(frozen=True)
class PowerMap:
    """Measured delay–angle power of one device pair, and its antennas."""

    power: Float32[np.ndarray, "delay beam"]
    """Power relative to the transmitted one."""
    beams: np.ndarray
    """Conjugate steering vectors, (beam, element), divided by the number of elements."""
    tx_xyz: Float64[np.ndarray, "element 3"]
    """Transmitting end of each element pair [m]."""
    rx_xyz: Float64[np.ndarray, "element 3"]
    """Receiving end of each element pair [m]."""


def _beam_sines(extent_m: float, wavelength_m: float) -> Float64[np.ndarray, "beam"]:
    """Sines of beam directions along one array axis, two per beam width."""
    if extent_m < 0.25 * wavelength_m:
        return np.zeros(1)
    count = int(np.ceil(2 * WIDEST_SINE * extent_m / wavelength_m * OVERSAMPLING)) + 1
    return np.linspace(-WIDEST_SINE, WIDEST_SINE, count)


def _along(virtual: Float64[np.ndarray, "element 3"]) -> Float64[np.ndarray, "element 2"]:
    """Places of a planar array's elements along its two axes [m]."""
    _, _, axes = np.linalg.svd(virtual - virtual.mean(axis=0))
    return (virtual - virtual.mean(axis=0)) @ axes[:2].T


def _runs(virtual: Float64[np.ndarray, "element 3"], wavelength_m: float) -> list[slice]:
    """An array whole, or runs of elements where it is too wide; see `MOST_BEAMS`."""
    sines = [_beam_sines(float(extent), wavelength_m) for extent in np.ptp(_along(virtual), axis=0)]
    if len(sines[0]) * len(sines[1]) <= MOST_BEAMS:
        return [slice(0, len(virtual))]
    runs, first = [], 0
    for end in range(1, len(virtual) + 1):
        wide = end < len(virtual) and np.linalg.norm(np.ptp(virtual[first : end + 1], axis=0))
        if end == len(virtual) or wide > RUN_WAVELENGTHS * wavelength_m:
            runs.append(slice(first, end))
            first = end
    return runs


def _beams(virtual: Float64[np.ndarray, "element 3"], wavelength_m: float) -> np.ndarray:
    """Steering vectors of a planar (virtual) array over directions in front of it."""
    along = _along(virtual)
    first = _beam_sines(float(np.ptp(along[:, 0])), wavelength_m)
    second = _beam_sines(float(np.ptp(along[:, 1])), wavelength_m)
    sines = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    sines = sines[np.sum(sines**2, axis=1) <= 1.0]
    phase = 2 * np.pi / wavelength_m * sines @ along.T
    return (np.exp(-1j * phase) / len(virtual)).astype(np.complex64)


def power_maps(observations: Observations) -> list[PowerMap]:
    """Delay–angle power of every pair of a transmitting and a receiving device.

    An aperture that is too wide for one far field makes several maps.

    Transmitting elements add to the aperture within a device; between devices each makes a
    map of its own. A pair that nothing changes, say behind furniture, has no map: it tells no
    direction, and its ratio of measured to expected power would be zero over zero.
    """
    if observations.kind == "delay_power":
        return delay_maps(observations)
    window = band_window(observations.subcarriers)
    wavelength_m = SPEED_OF_LIGHT / observations.centre_hz
    pair, names = observations.pairs
    maps = []
    for index, (a, b) in enumerate(names):
        tx, rx = np.nonzero(pair == index)
        for group in [tx >= 0] if a == b else [tx == t for t in np.unique(tx)]:
            t, r = tx[group], rx[group]
            tx_xyz, rx_xyz = observations.layout.tx_xyz[t], observations.layout.rx_xyz[r]
            virtual = (rx_xyz - rx_xyz.mean(axis=0)) + (tx_xyz - tx_xyz.mean(axis=0))
            profile = delay_profile(observations.delta[t, r], window, OVERSAMPLING, peak=True)
            for run in _runs(virtual, wavelength_m):
                beams = _beams(virtual[run], wavelength_m)
                power = np.abs(beams @ profile[run]).T ** 2
                if power.any():
                    ends = tx_xyz[run], rx_xyz[run]
                    maps.append(PowerMap(power.astype(np.float32), beams, *ends))
    return maps


def delay_maps(observations: Observations) -> list[PowerMap]:
    """Power over delay alone, one map per device pair, or per link of wide arrays.

    Links of a pair are averaged where their antennas stand within one resolution cell of
    each other, so that a place has the same delay in all of them.
    """
    change = observations.delay_change
    assert change is not None
    layout = observations.layout
    pair, names = observations.pairs
    cell_m = SPEED_OF_LIGHT / float(np.ptp(observations.freq_hz))
    maps = []
    for index in range(len(names)):
        tx, rx = np.nonzero(pair == index)
        width_m = sum(
            float(np.linalg.norm(np.ptp(xyz, axis=0)))
            for xyz in (layout.tx_xyz[tx], layout.rx_xyz[rx])
        )
        groups = [np.arange(len(tx))] if width_m <= cell_m else np.arange(len(tx))[:, None]
        for group in groups:
            t, r = tx[group], rx[group]
            power = (change[t, r] ** 2).mean(axis=0)
            if not power.any():
                continue
            centres = layout.tx_xyz[t].mean(axis=0), layout.rx_xyz[r].mean(axis=0)
            everywhere = np.ones((1, 1), dtype=np.complex64)
            maps.append(PowerMap(power[:, None], everywhere, centres[0][None], centres[1][None]))
    return maps


class DelayPowerModel:
    """Expected delay–angle power of points, linear in their reflected power."""

    def __init__(self, observations: Observations, points: Float[np.ndarray, "M 3"]) -> None:
        self.maps = power_maps(observations)
        self._spacing_hz = float(observations.freq_hz[1] - observations.freq_hz[0])
        self._window = band_window(observations.subcarriers)
        self._wavelength_m = SPEED_OF_LIGHT / observations.centre_hz
        parts = [self._factors(entry, points.astype(np.float64)) for entry in self.maps]
        #: Per map: delay response times spreading (delay, M), beam response (M, beam), data.
        self.parts = parts

    def _pulse(self) -> tuple[np.ndarray, np.ndarray]:
        """Power of the band's pulse over one period of delay [s]."""
        period = 1.0 / self._spacing_hz
        delay = np.linspace(-0.5 * period, 0.5 * period, 16 * len(self._window) + 1)
        phase = 2 * np.pi * self._spacing_hz * np.outer(delay, np.arange(len(self._window)))
        response = np.abs(np.exp(1j * phase) @ self._window)
        return delay, response**2

    def _factors(self, entry: PowerMap, points: np.ndarray) -> tuple[np.ndarray, ...]:
        centre_t, centre_r = entry.tx_xyz.mean(axis=0), entry.rx_xyz.mean(axis=0)
        d_t = np.linalg.norm(points - centre_t, axis=1)
        d_r = np.linalg.norm(points - centre_r, axis=1)
        period = 1.0 / self._spacing_hz
        grid = np.arange(len(entry.power)) / len(entry.power) * period
        late = (grid[:, None] - (d_t + d_r) / SPEED_OF_LIGHT + 0.5 * period) % period
        delays, pulse = self._pulse()
        response = np.interp(late - 0.5 * period, delays, pulse)
        spreading = (self._wavelength_m / ((4 * np.pi) ** 1.5 * d_t * d_r)) ** 2
        legs = np.linalg.norm(points[None] - entry.tx_xyz[:, None], axis=2)
        legs += np.linalg.norm(points[None] - entry.rx_xyz[:, None], axis=2)
        arrived = np.exp(-2j * np.pi / self._wavelength_m * (legs - (d_t + d_r)))
        beam = np.abs(entry.beams @ arrived.astype(np.complex64)).T ** 2
        keep = response.max(axis=1) > 1e-3
        delay_part = (response * spreading)[keep].astype(np.float32)
        return delay_part, beam.astype(np.float32), entry.power[keep]

    def expected(
        self, part: int, power: Float32[np.ndarray, "M"]
    ) -> Float32[np.ndarray, "delay beam"]:
        """Expected map `part` for the reflected powers seen by that pair."""
        delay_part, beam, _ = self.parts[part]
        return (delay_part * power) @ beam

    def scaled(
        self, power: Float32[np.ndarray, "M"], visibility: Float32[np.ndarray, "map M"]
    ) -> Float32[np.ndarray, "M"]:
        """`power` times the one factor that matches the total measured power."""
        have = sum(float(self.expected(k, power * v).sum()) for k, v in enumerate(visibility))
        want = sum(float(data.sum()) for _, _, data in self.parts)
        return power * np.float32(want / max(have, 1e-30))
