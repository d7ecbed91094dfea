# SPDX-License-Identifier: Apache-2.0
"""Delay–angle features of traced paths, for synthetic data (paper section 3.2).

A path says at a point p how well p agrees with its delay and with its directions at both ends:

    φ_c(p)² = mean over pairs of Σ_i |a_i(f_c)|² e^{−(τ_i c − d_t − d_r)²/σ_d² − (θ_t² + θ_r²)/σ_θ²}

with σ_d half the band's range cell c/B, the angles θ between the path's ends and the lines to p,
and each pair in units of its own power. Only delays, angles and amplitudes of visible device pairs
enter, never where a path's corners are. The tracer tells which paths meet somebody, which no radio
does: this is a bound for encoders of channels, not a baseline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Float, Float32, Float64

from rfgs_core.encode.protocol import FEATURES, FrameChannel
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.path_table import PathTable

#: σ_θ [rad]: about the beam of eight antennas.
ANGLE_RAD = 0.2
#: Exponents below this add nothing.
_SMALLEST = -20.0


@dataclass(frozen=True)
class PathFeatures:
    """`Encoder` of one frame; the channel it is given only says what may be seen."""

    table: PathTable
    """Paths that meet something that moves."""

    def __call__(
        self, seen: FrameChannel, points: Float64[np.ndarray, "N 3"]
    ) -> Float32[np.ndarray, "N 32"]:
        """Features at points [m], see `Encoder`."""
        elements, (tx, rx) = seen.layout, np.nonzero(seen.links)
        pairs_of_links = (elements.tx_site[tx], elements.rx_site[rx])
        visible = {(int(a), int(b)) for a, b in zip(*pairs_of_links, strict=True)}
        sites = list(zip(self.table.tx_site.tolist(), self.table.rx_site.tolist(), strict=True))
        rows = self.table.select(np.array([pair in visible for pair in sites], dtype=bool))
        out = np.zeros((len(points), FEATURES))
        if len(rows) == 0:
            return out.astype(np.float32)
        bandwidth_hz = float(seen.freq_hz[-1] - seen.freq_hz[0])
        _agreement(
            np.ascontiguousarray(points, dtype=np.float64),
            _sites(elements.tx_xyz, elements.tx_site)[rows.tx_site],
            _sites(elements.rx_xyz, elements.rx_site)[rows.rx_site],
            _unit(rows.departure_zenith_rad, rows.departure_azimuth_rad),
            _unit(rows.arrival_zenith_rad, rows.arrival_azimuth_rad),
            rows.length_m,
            _powers(rows, seen.freq_hz),
            2.0 * bandwidth_hz / SPEED_OF_LIGHT,
            out,
        )
        return np.sqrt(out).astype(np.float32)


def _powers(
    rows: PathTable, freq_hz: Float64[np.ndarray, "subcarrier"]
) -> Float64[np.ndarray, "path 32"]:
    """|a_i(f_c)|² over ports, divided by the pair's own power and the number of pairs."""
    middle = freq_hz[np.arange(FEATURES) * len(freq_hz) // FEATURES]
    power = (np.abs(rows.amplitude_at(middle)) ** 2).sum(axis=1)
    _, pair = np.unique(np.stack([rows.tx_site, rows.rx_site]), axis=1, return_inverse=True)
    pair = pair.reshape(-1)
    total = np.bincount(pair, power.mean(axis=1))
    return power / np.where(total > 0.0, total, 1.0)[pair, None] / len(total)


def _sites(
    xyz: Float64[np.ndarray, "element 3"], site: np.ndarray
) -> Float64[np.ndarray, "site 3"]:
    """Centres of sites [m]."""
    return np.stack([xyz[site == number].mean(axis=0) for number in range(site.max() + 1)])


def _unit(
    zenith_rad: Float[np.ndarray, "path"], azimuth_rad: Float[np.ndarray, "path"]
) -> Float64[np.ndarray, "path 3"]:
    """Unit vectors of directions."""
    zenith, azimuth = zenith_rad.astype(np.float64), azimuth_rad.astype(np.float64)
    across = np.sin(zenith)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.cos(zenith)], axis=1)


@numba.njit(cache=True)
def _squared_angle(x, y, z, distance, unit):
    """Squared angle [rad²] between a line and a direction; nothing is known at distance zero."""
    if distance < 1e-9:
        return 0.0
    cosine = (x * unit[0] + y * unit[1] + z * unit[2]) / distance
    return np.arccos(min(1.0, max(-1.0, cosine))) ** 2


@numba.njit(parallel=True, cache=True)
def _agreement(points, tx, rx, departure, arrival, length_m, power, per_m, out):
    """Adds every path's agreement with every point to `out[point, feature]`."""
    for n in numba.prange(points.shape[0]):
        for row in range(len(length_m)):
            ax, ay, az = points[n] - tx[row]
            bx, by, bz = points[n] - rx[row]
            d_t = np.sqrt(ax * ax + ay * ay + az * az)
            d_r = np.sqrt(bx * bx + by * by + bz * bz)
            exponent = -(((length_m[row] - d_t - d_r) * per_m) ** 2)
            if exponent < _SMALLEST:
                continue
            squared = _squared_angle(ax, ay, az, d_t, departure[row])
            squared += _squared_angle(bx, by, bz, d_r, arrival[row])
            exponent -= squared / ANGLE_RAD**2
            if exponent < _SMALLEST:
                continue
            weight = np.exp(exponent)
            for feature in range(power.shape[1]):
                out[n, feature] += weight * power[row, feature]
