# SPDX-License-Identifier: Apache-2.0
"""Beam–range maps of a body straight from its facets, without forming the channel.

The map of `encode.body_maps` is linear in the channel before powers are taken, and the channel of
facets is a sum. A facet therefore adds its amplitude times the response of either array to its
direction times the response of the band to its path, each read from a table. A wall adds the same
facets again, met from the mirror image of the transmitter or heard by that of the receiver.

Near the line of sight between two ends a body does not echo but shadows. Kirchhoff's screen, the
lit side of the body, takes away ∬ e^{−jk(d_t+d_r)} dA / (4π d_t d_r) of the direct wave: facets of
amplitude A n·k_i with the sign of a screen instead of the reflection of skin.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Bool, Complex128, Float64

from rfgs_core.encode.body_maps import AZIMUTHS, ELEVATIONS, ArrayEnd, Ranges, View
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_transform

#: Direction cosines and resolution cells are tabulated in steps of one over this.
PER_COSINE, PER_CELL = 128, 32
#: Largest difference of direction cosines that a table holds, and its samples.
WIDEST = 2.6
TABLE = math.ceil(2 * WIDEST * PER_COSINE) + 1
#: The side lobes of a whole band are read to this many cells [cell] ...
_LOBES = 6
#: ... and of one with a gap, whose lobes fall slowly, over a whole map of 4 GHz.
LOBES_OF_GAP = 48
#: Facets damped by more than e^-6 are left out.
MOST_DAMPED = 6.0
#: Cosine between the way in and the way out beyond which a body shadows, in full and at all.
FORWARD, ASLANT = 0.75, 0.45


class Band(NamedTuple):
    """What turns paths into ranges."""

    wavenumber: float
    """2π/λ at the centre [1/m]."""
    cell_m: float
    """Resolution c/B [m]."""
    response: Complex128[np.ndarray, "sample"]
    """Sum of the weights times e^{j(k − k_centre)x}, x in cells, `PER_CELL` samples each."""
    reach: int
    """Cells either side that the table holds."""
    skin: float
    """Size of the reflection coefficient of skin."""

    @staticmethod
    def of(
        freq_hz: Float64[np.ndarray, "subcarrier"],
        weights: Float64[np.ndarray, "subcarrier"],
        skin: float,
    ) -> Band:
        """The band of weighted subcarriers; `skin` is the size of skin's reflection coefficient."""
        spacing_hz = float(freq_hz[1] - freq_hz[0])
        centre_hz = float(freq_hz.mean())
        reach = _LOBES if (weights > 0).all() else LOBES_OF_GAP
        # Zeros beyond the band give the samples between whole cells.
        size = len(freq_hz) * PER_CELL
        sample = np.arange(-reach * PER_CELL, reach * PER_CELL + 1)
        to_centre = np.exp(-1j * np.pi * (len(freq_hz) - 1) / size * sample)
        response = delay_transform(weights, size)[sample % size] * size * to_centre
        cell_m = SPEED_OF_LIGHT / (spacing_hz * len(freq_hz))
        return Band(2.0 * np.pi * centre_hz / SPEED_OF_LIGHT, cell_m, response, reach, skin)


def array_table(end: ArrayEnd, axis: int, wavenumber: float) -> Complex128[np.ndarray, "sample"]:
    """Response of an array steered a direction cosine off, along one of its axes."""
    # Places of like arrays agree to rounding, and share a table.
    return _table(tuple(np.round(end.offsets[:, axis], 6).tolist()), wavenumber)


@functools.lru_cache(maxsize=256)
def _table(places_m: tuple[float, ...], wavenumber: float) -> np.ndarray:
    if max(places_m) - min(places_m) < 1e-5:
        return np.zeros(0, dtype=np.complex128)
    off = np.arange(TABLE) / PER_COSINE - WIDEST
    return np.exp(1j * wavenumber * np.outer(off, places_m)).mean(axis=1)


def mirrored(end: ArrayEnd, axis: int, at_m: float) -> ArrayEnd:
    """Image of an array in a wall across one of the world's axes."""
    centre, axes = end.centre.copy(), end.axes.copy()
    centre[axis] = 2.0 * at_m - centre[axis]
    axes[:, axis] *= -1.0
    return ArrayEnd(centre, axes, end.offsets)


class Seen(NamedTuple):
    """Facets as one end of a link sees them."""

    points: Float64[np.ndarray, "facet 3"]
    normals: Float64[np.ndarray, "facet 3"]
    areas: Float64[np.ndarray, "facet"]
    by_tx: Bool[np.ndarray, "facet"]
    by_rx: Bool[np.ndarray, "facet"]


class Listener(NamedTuple):
    """A device pair that listens around a point: what does not depend on the body."""

    view: View
    """The two ends."""
    band: Band
    cosines: tuple[Float64[np.ndarray, "2"], Float64[np.ndarray, "2"]]
    """Direction cosines of the point at either end."""
    tables: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    """Responses of the transmitter along y and z, and of the receiver."""
    first_m: float
    """Path of the first range [m]."""
    ranges: Ranges
    spreading: float
    """4π d_t d_r of the point [m²]."""

    @staticmethod
    def at(point: Float64[np.ndarray, "3"], view: View, band: Band) -> Listener:
        """Prepares a pair to listen around `point` [m]."""
        ranges = Ranges.of(SPEED_OF_LIGHT / band.cell_m)
        tables = [
            array_table(end, axis, band.wavenumber) for end in (view.tx, view.rx) for axis in (0, 1)
        ]
        first_m = view.path_m(point) + float(ranges.offsets_m[0])
        cosines = view.tx.cosines(point), view.rx.cosines(point)
        t_y, t_z, r_y, r_z = tables
        spreading = view.spreading(point)
        return Listener(view, band, cosines, (t_y, t_z, r_y, r_z), first_m, ranges, spreading)

    def empty_map(self) -> Complex128[np.ndarray, "elevation azimuth range"]:
        """A map of nothing."""
        return np.zeros((len(ELEVATIONS), len(AZIMUTHS), self.ranges.count), np.complex128)

    def add(
        self,
        out: Complex128[np.ndarray, "elevation azimuth range"],
        seen: Seen,
        tx: ArrayEnd,
        rx: ArrayEnd,
        gain: float = 1.0,
    ) -> None:
        """Adds what a body sends from one end to another.

        Args:
            out: The map, amplitudes [m²].
            seen: The body's facets.
            tx: The transmitter, or its image in a wall.
            rx: The receiver, or its image.
            gain: Amplitude of the way by the wall.
        """
        band = self.band
        _add_echo(
            seen.points, seen.normals, seen.areas, seen.by_tx, seen.by_rx, tx.centre, rx.centre,
            tx.axes, rx.axes, *self.cosines, *self.tables, band.response, band.reach,
            band.wavenumber, band.cell_m, self.first_m, self.ranges.step_m,
            gain * self.spreading, 1.0 / band.skin, AZIMUTHS, ELEVATIONS, out,
        )  # fmt: skip


@numba.njit(cache=True, nogil=True, inline="always")
def _read(table: np.ndarray, off: float) -> complex:
    """A table of direction cosines at `off`; 1 of an array with a single place along the axis."""
    if len(table) == 0:
        return 1.0 + 0.0j
    at = min(max((off + WIDEST) * PER_COSINE, 0.0), len(table) - 1.001)
    low = int(at)
    return table[low] + (at - low) * (table[low + 1] - table[low])


@numba.njit(cache=True, nogil=True, inline="always")
def _amplitude(
    c_i: float, c_s: float, forward: float, heard: bool, k2_area: float, screen: float
) -> float:
    """What a facet sends on, over A/(4π d_t d_r): an echo, a shadow or both.

    Args:
        c_i: Cosine of the way in against the facet's normal.
        c_s: Cosine of the way out.
        forward: Cosine between the two ways.
        heard: Whether the receiver sees the facet.
        k2_area: k² A.
        screen: What a shadow weighs against an echo.
    """
    q_n = c_i + c_s
    damped = k2_area * max(2.0 - 2.0 * forward - q_n * q_n, 0.0) / 24.0
    if damped > MOST_DAMPED:
        return 0.0
    sent = 0.5 * q_n if heard and c_s > 0.0 else 0.0
    sent += shadowing(forward) * screen * c_i
    return sent * math.exp(-damped)


@numba.njit(cache=True, nogil=True, inline="always")
def shadowing(forward: float) -> float:
    """Share of a facet's shadow that is heard, from 0 aslant to 1 behind the body.

    Args:
        forward: Cosine between the way in and the way out.
    """
    return min(max((forward - ASLANT) / (FORWARD - ASLANT), 0.0), 1.0)


@numba.njit(cache=True, nogil=True, inline="always")
def _spread(
    up: np.ndarray,
    across: np.ndarray,
    at: float,
    cells: float,
    response: np.ndarray,
    reach: int,
    out: np.ndarray,
) -> None:
    """Adds a wave to the ranges around `at`, with its share of each beam."""
    low = max(math.ceil(at - reach / cells), 0)
    high = min(math.floor(at + reach / cells), out.shape[2] - 1)
    for m in range(low, high + 1):
        x = ((m - at) * cells + reach) * PER_CELL
        j = min(max(int(x), 0), len(response) - 2)
        window = response[j] + (x - j) * (response[j + 1] - response[j])
        for e in range(len(up)):
            value = window * up[e]
            for a in range(len(across)):
                out[e, a, m] += value * across[a]


@numba.njit(cache=True, nogil=True, fastmath=True)
def _add_echo(
    points: np.ndarray, normals: np.ndarray, areas: np.ndarray, by_tx: np.ndarray,
    by_rx: np.ndarray, tx: np.ndarray, rx: np.ndarray, tx_axes: np.ndarray,
    rx_axes: np.ndarray, tx_cos: np.ndarray, rx_cos: np.ndarray, tx_y: np.ndarray,
    tx_z: np.ndarray, rx_y: np.ndarray, rx_z: np.ndarray, response: np.ndarray,
    reach: int, k: float, cell_m: float, first_m: float, step_m: float, scale: float,
    screen: float, azimuths: np.ndarray, elevations: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Sums over facets; see `Listener.add`."""
    up, across = np.zeros(len(elevations), np.complex128), np.zeros(len(azimuths), np.complex128)
    for i in range(len(points)):
        if not by_tx[i]:
            continue
        ix, iy, iz = points[i, 0] - tx[0], points[i, 1] - tx[1], points[i, 2] - tx[2]
        sx, sy, sz = rx[0] - points[i, 0], rx[1] - points[i, 1], rx[2] - points[i, 2]
        d_t, d_r = math.sqrt(ix * ix + iy * iy + iz * iz), math.sqrt(sx * sx + sy * sy + sz * sz)
        ix, iy, iz, sx, sy, sz = ix / d_t, iy / d_t, iz / d_t, sx / d_r, sy / d_r, sz / d_r
        c_i = -(ix * normals[i, 0] + iy * normals[i, 1] + iz * normals[i, 2])
        c_s = sx * normals[i, 0] + sy * normals[i, 1] + sz * normals[i, 2]
        forward = ix * sx + iy * sy + iz * sz
        amplitude = _amplitude(c_i, c_s, forward, by_rx[i], k * k * areas[i], screen)
        if c_i <= 0.0 or amplitude == 0.0:
            continue
        amplitude *= scale * areas[i] / (4.0 * math.pi * d_t * d_r)
        phase = k * (d_t + d_r)
        wave = complex(amplitude * math.cos(phase), -amplitude * math.sin(phase))
        t_y = ix * tx_axes[0, 0] + iy * tx_axes[0, 1] + iz * tx_axes[0, 2] - tx_cos[0]
        t_z = ix * tx_axes[1, 0] + iy * tx_axes[1, 1] + iz * tx_axes[1, 2] - tx_cos[1]
        r_y = -(sx * rx_axes[0, 0] + sy * rx_axes[0, 1] + sz * rx_axes[0, 2]) - rx_cos[0]
        r_z = -(sx * rx_axes[1, 0] + sy * rx_axes[1, 1] + sz * rx_axes[1, 2]) - rx_cos[1]
        for e in range(len(up)):
            up[e] = wave * _read(tx_z, t_z - elevations[e]) * _read(rx_z, r_z - elevations[e])
        for a in range(len(across)):
            across[a] = _read(tx_y, t_y - azimuths[a]) * _read(rx_y, r_y - azimuths[a])
        # Range m listens to first_m + m step_m; the response is centred on the path itself.
        at = (d_t + d_r - first_m) / step_m
        _spread(up, across, at, step_m / cell_m, response, reach, out)
