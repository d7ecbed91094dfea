# SPDX-License-Identifier: Apache-2.0
"""What one device pair says of a body, in few numbers: steered to it, and added up in blocks.

Antennas next to each other and subcarriers next to each other hear nearly the same of somebody
they are steered to. Their sums keep what is heard and average noise, and whatever comes from
elsewhere; leaving some out would do neither.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex128, Float, Float64, Int64

from rfgs_core.encode.body_maps import ArrayEnd, View, views_of
from rfgs_core.measure.observations import Observations
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Most blocks of an array along its height, and along its width with few and with many bands.
ROWS, COLUMNS, FEW_COLUMNS = 4, 3, 2
#: Length of path in which bands must tell echoes apart [m], and the fewest and most bands.
COVERED_M, BANDS = 2.0, (6, 32)
#: More bands than this are many.
_FEW_BANDS = 8


class End(NamedTuple):
    """The elements of one end, in blocks."""

    xyz: Float64[np.ndarray, "element 3"]
    """Where they are [m]."""
    centre: Float64[np.ndarray, "3"]
    """Mean of the elements [m]."""
    steered_m: Float64[np.ndarray, "element"]
    """Distance of each to the place that they are steered to [m]."""
    block: Int64[np.ndarray, "element"]
    """Block of each."""
    share: Float64[np.ndarray, "block"]
    """What elements of a block are multiplied by: noise stays as strong as in one of them."""

    @staticmethod
    def of(
        end: ArrayEnd, xyz: Float64[np.ndarray, "element 3"], centre: np.ndarray, columns: int
    ) -> End:
        """Blocks of some elements, at most `ROWS` high and `columns` wide."""
        across, up = (
            _split(end.offsets[:, axis], most) for axis, most in ((0, columns), (1, ROWS))
        )
        block = np.unique(up * (across.max() + 1) + across, return_inverse=True)[1].astype(np.int64)
        steered_m = np.linalg.norm(xyz - centre, axis=1)
        share = 1.0 / np.sqrt(np.bincount(block))
        return End(np.ascontiguousarray(xyz), xyz.mean(axis=0), steered_m, block, share)


class Bands(NamedTuple):
    """Subcarriers in blocks."""

    first_k: float
    """Wavenumber of the first subcarrier [1/m]."""
    step_k: float
    """Between neighbouring subcarriers [1/m]."""
    middle_k: float
    """Of the visible subcarriers, on average [1/m]."""
    block: Int64[np.ndarray, "subcarrier"]
    """Block of each; −1 where hidden."""
    share: Float64[np.ndarray, "block"]
    """What subcarriers of a block are multiplied by."""

    @property
    def half_k(self) -> float:
        """Half of the band's width [1/m]."""
        return 0.5 * abs(self.step_k) * len(self.block)

    @staticmethod
    def of(
        freq_hz: Float64[np.ndarray, "subcarrier"], visible: Bool[np.ndarray, "subcarrier"]
    ) -> Bands:
        """Blocks of equally spaced subcarriers that tell apart `COVERED_M` of path."""
        count = int(np.clip(round(COVERED_M / path_resolution_m(freq_hz)), *BANDS))
        place = np.arange(len(freq_hz)) * count // len(freq_hz)
        block = np.full(len(freq_hz), -1, dtype=np.int64)
        block[visible] = np.unique(place[visible], return_inverse=True)[1]
        k = 2.0 * np.pi * freq_hz / SPEED_OF_LIGHT
        share = 1.0 / np.sqrt(np.bincount(block[visible]))
        return Bands(float(k[0]), float(k[1] - k[0]), float(k[visible].mean()), block, share)


class Pair(NamedTuple):
    """A device pair and its entries: transmitting blocks, receiving blocks, bands fastest."""

    devices: tuple[int, int]
    """Transmitting and receiving device."""
    tx: End
    rx: End
    bands: Bands
    change: Complex128[np.ndarray, "entry"]
    """Entries in units of their root mean square."""
    scale: float
    """That root mean square."""


def path_resolution_m(freq_hz: Float64[np.ndarray, "subcarrier"]) -> float:
    """By how much paths must differ for a band of equally spaced subcarriers to resolve them [m].

    The speed of light over the bandwidth.
    """
    return SPEED_OF_LIGHT / (float(freq_hz[1] - freq_hz[0]) * len(freq_hz))


def pairs_of(observations: Observations, centre: Float[np.ndarray, "3"]) -> list[Pair]:
    """Every device pair of a frame, steered to a place [m].

    Args:
        observations: The frame; what is hidden has no influence.
        centre: Middle of the body [m].
    """
    bands = Bands.of(observations.freq_hz, observations.subcarriers)
    columns = COLUMNS if len(bands.share) <= _FEW_BANDS else FEW_COLUMNS
    return [
        _pair(observations, view, np.asarray(centre, np.float64), bands, columns)
        for view in views_of(observations.layout, observations.links)
    ]


def _pair(
    observations: Observations, view: View, centre: np.ndarray, bands: Bands, columns: int
) -> Pair:
    layout = observations.layout
    own = layout.links_between(*view.pair) & observations.links
    tx, rx = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
    ends = (
        End.of(view.tx, layout.tx_xyz[tx], centre, columns),
        End.of(view.rx, layout.rx_xyz[rx], centre, columns),
    )
    k = bands.first_k + bands.step_k * np.arange(len(bands.block))
    block = np.where(own[np.ix_(tx, rx)][..., None], observations.delta[np.ix_(tx, rx)], 0.0)
    for end, axis in zip(ends, (0, 1), strict=True):
        turned = np.exp(1j * k * end.steered_m[:, None])
        block = _summed(block * np.expand_dims(turned, 1 - axis), end.block, end.share, axis)
    change = _summed(block, bands.block, bands.share, 2).ravel()
    scale = np.sqrt(np.mean(np.abs(change) ** 2)) or 1.0
    return Pair(view.pair, *ends, bands, change / scale, float(scale))


def _summed(values: np.ndarray, block: np.ndarray, share: np.ndarray, axis: int) -> np.ndarray:
    """Sums over the members of each block along an axis, times its share."""
    member = (block == np.arange(len(share))[:, None]) * share[:, None]
    return np.moveaxis(np.tensordot(member, values, axes=(1, axis)), 0, axis)


def _split(places_m: Float64[np.ndarray, "element"], most: int) -> Int64[np.ndarray, "element"]:
    """Neighbours along a line in at most `most` blocks of like size."""
    line, member = np.unique(np.round(places_m, 5), return_inverse=True)
    count = min(len(line), most)
    return (np.arange(len(line)) * count // len(line))[member].astype(np.int64)
