# SPDX-License-Identifier: Apache-2.0
"""What each device pair hears of a body: power over elevation, azimuth and range around it.

The beams and the ranges hang on a point of the body's axis, so that a map hardly depends on where
the body is. Arrays are steered as plane waves around the direction of that point, which holds
beyond 2 D²/λ: 1.3 m for 8×8 elements at 5.8 GHz.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Float32, Float64

from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import band_window, hann
from rfgs_core.rotations import rotation_rows

#: Offsets of the beams from the direction of the point, as direction cosines.
ELEVATIONS = (np.arange(7) - 3) * 0.15
AZIMUTHS = (np.arange(5) - 2) * 0.15
#: Height above the floor of the point that maps are centred on [m].
CENTRE_HEIGHT_M = 0.95
#: Length of path that a map covers [m]: arms and legs of an adult from any side.
COVERED_M = 3.6
#: Ranges no coarser than this lie one resolution cell c/B apart, others half a cell [m].
_FINE_M = 0.3


class ArrayEnd(NamedTuple):
    """The elements of one device that send, or receive."""

    centre: Float64[np.ndarray, "3"]
    """Mean of the elements [m]."""
    axes: Float64[np.ndarray, "2 3"]
    """The device's own y (horizontal) and z (vertical)."""
    offsets: Float64[np.ndarray, "element 2"]
    """The elements along these axes, from the centre [m]."""

    @staticmethod
    def of(xyz: Float64[np.ndarray, "element 3"], quat_wxyz: np.ndarray) -> ArrayEnd:
        """Elements at `xyz` [m] of a device turned by `quat_wxyz`."""
        axes = np.array(rotation_rows(*np.asarray(quat_wxyz, dtype=np.float64))).T[1:]
        centre = xyz.mean(axis=0)
        return ArrayEnd(centre, np.ascontiguousarray(axes), (xyz - centre) @ axes.T)

    def cosines(self, point: Float[np.ndarray, "3"]) -> Float64[np.ndarray, "2"]:
        """Direction cosines of a point along the two axes."""
        towards = np.asarray(point) - self.centre
        return self.axes @ towards / np.linalg.norm(towards)


class View(NamedTuple):
    """What one device pair looks with."""

    pair: tuple[int, int]
    """Transmitting and receiving device."""
    tx: ArrayEnd
    rx: ArrayEnd

    def path_m(self, point: Float[np.ndarray, "3"]) -> float:
        """Length of the path by way of a point [m]."""
        legs = np.linalg.norm(point - self.tx.centre), np.linalg.norm(point - self.rx.centre)
        return float(legs[0] + legs[1])

    def spreading(self, point: Float[np.ndarray, "3"]) -> float:
        """4π d_t d_r of a point [m²]: what an echo's amplitude is divided by."""
        legs = np.linalg.norm(point - self.tx.centre), np.linalg.norm(point - self.rx.centre)
        return float(4.0 * np.pi * legs[0] * legs[1])


class Ranges(NamedTuple):
    """Path lengths of a map, around that of its point."""

    step_m: float
    count: int

    @staticmethod
    def of(bandwidth_hz: float) -> Ranges:
        """As fine as a bandwidth resolves."""
        cell_m = SPEED_OF_LIGHT / bandwidth_hz
        step_m = cell_m if cell_m <= _FINE_M else 0.5 * cell_m
        return Ranges(step_m, max(int(np.ceil(COVERED_M / step_m - 1e-9)), 2))

    @property
    def offsets_m(self) -> Float64[np.ndarray, "range"]:
        """Path length of each range less that of the point [m]."""
        return (np.arange(self.count) - 0.5 * (self.count - 1)) * self.step_m

    @staticmethod
    def of_band(freq_hz: Float64[np.ndarray, "subcarrier"]) -> Ranges:
        """As fine as equally spaced subcarriers resolve."""
        return Ranges.of(float(freq_hz[1] - freq_hz[0]) * len(freq_hz))


def views_of(layout: Layout, links: Bool[np.ndarray, "tx rx"]) -> list[View]:
    """The device pairs of some links, each with the elements that all of its links share."""
    views = []
    for a, b in layout.pairs_of(links)[1]:
        own = layout.links_between(a, b) & links
        tx, rx = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
        ends = (
            ArrayEnd.of(layout.tx_xyz[tx], layout.tx_quat_wxyz[tx[0]]),
            ArrayEnd.of(layout.rx_xyz[rx], layout.rx_quat_wxyz[rx[0]]),
        )
        views.append(View((a, b), *ends))
    return views


def distinct_places(places_m: Float64[np.ndarray, "element"]) -> int:
    """How many places elements have along an axis of their array."""
    return len(np.unique(np.round(places_m, 5)))


def body_maps(
    change: Complex[np.ndarray, "tx rx subcarrier"],
    layout: Layout,
    links: Bool[np.ndarray, "tx rx"],
    freq_hz: Float64[np.ndarray, "subcarrier"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
    point: Float[np.ndarray, "3"],
) -> Float32[np.ndarray, "pair elevation azimuth range"]:
    """Echo power of a body around `point`, in the order of `views_of`.

    Args:
        change: csi − csi_static.
        layout: Antenna elements.
        links: Links to use.
        freq_hz: Subcarriers [Hz], equally spaced.
        subcarriers: Subcarriers to use.
        point: Centre of the maps [m].

    Returns:
        Power, times (4π d_t d_r)² of the point: a mirror of area A facing both ends shows as A²
        [m⁴], wherever it is.
    """
    ranges = Ranges.of_band(freq_hz)
    weights = band_window(subcarriers, hann)
    wavenumber = 2.0 * np.pi * freq_hz / SPEED_OF_LIGHT
    centre_k = float(wavenumber.mean())
    maps = []
    for view in views_of(layout, links):
        own = layout.links_between(*view.pair) & links
        block = change[np.ix_(own.any(axis=1), own.any(axis=0))]
        lengths = view.path_m(point) + ranges.offsets_m
        profile = (block * weights) @ np.exp(1j * np.outer(wavenumber, lengths))
        tx, rx = _steering(view.tx, point, centre_k), _steering(view.rx, point, centre_k)
        beams = np.einsum("eat,ear,trm->eam", tx, rx, profile)
        maps.append(np.abs(beams * view.spreading(point)) ** 2)
    return np.array(maps, dtype=np.float32)


def _steering(
    end: ArrayEnd, point: Float[np.ndarray, "3"], wavenumber: float
) -> Complex[np.ndarray, "elevation azimuth element"]:
    """Weights that let plane waves of each beam add up to 1."""
    across, up = end.cosines(point)
    y, z = end.offsets[:, 0], end.offsets[:, 1]
    vertical = np.exp(-1j * wavenumber * np.outer(up + ELEVATIONS, z))
    horizontal = np.exp(-1j * wavenumber * np.outer(across + AZIMUTHS, y))
    return vertical[:, None] * horizontal[None] / len(y)
