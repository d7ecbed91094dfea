# SPDX-License-Identifier: Apache-2.0
"""What a baseline may look at: one frame without the held-out entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Bool, Complex, Float, Float32

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.dataset.splits import HeldOut
from rfgs_core.encode.matched_filter import matched_filter_map
from rfgs_core.evaluate.grid import Grid
from rfgs_core.measure.observations import excess_turn
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT


# Two frames are never compared; one is a key of what was derived of it.
@dataclass(frozen=True, eq=False)
class Evidence:
    """One frame as training sees it; hidden entries are NaN, so that reading one shows."""

    delta: Complex[np.ndarray, "tx rx subcarrier"]
    """csi − csi_static; NaN where held out or not measured."""
    static: Complex[np.ndarray, "tx rx subcarrier"]
    """csi_static; NaN where held out or not measured."""
    layout: Layout
    """Antenna elements of the radio."""
    freq_hz: Float[np.ndarray, "subcarrier"]
    """Subcarrier frequencies [Hz], equally spaced."""
    link_visible: Bool[np.ndarray, "tx rx"]
    """Links with at least one visible subcarrier."""
    subcarrier_visible: Bool[np.ndarray, "subcarrier"]
    """Subcarriers that are not held out."""
    grid: Grid
    """Grid to score."""
    voxels: int
    """Number of voxels a prediction has."""
    power_map: PowerMap | None = None
    """Power maps where antennas are not coherent; None: the matched filter of `delta`."""
    method_centroid_m: Float[np.ndarray, "3"] | None = None
    """Centroid of the evaluated method's own prediction [m]; None if it predicts nothing."""
    method_bodies: Bodies | None = None
    """Where it has its bodies; None if it does not tell."""

    @staticmethod
    def hide(
        csi: Complex[np.ndarray, "tx rx subcarrier"],
        csi_static: Complex[np.ndarray, "tx rx subcarrier"],
        held_out: HeldOut,
        layout: Layout,
        freq_hz: Float[np.ndarray, "subcarrier"],
        grid: Grid,
        voxels: int,
        power_map: PowerMap | None = None,
    ) -> Evidence:
        """Evidence of one frame: everything that is held out or lost becomes NaN."""
        visible = held_out.visible & np.isfinite(csi)
        hidden = np.complex64(complex(np.nan, np.nan))
        return Evidence(
            delta=np.where(visible, csi - csi_static, hidden).astype(np.complex64),
            static=np.where(visible, csi_static, hidden).astype(np.complex64),
            layout=layout,
            freq_hz=freq_hz,
            link_visible=visible.any(axis=2),
            subcarrier_visible=visible.any(axis=(0, 1)),
            grid=grid,
            voxels=voxels,
            power_map=power_map,
        )

    def with_method(
        self, centroid_m: Float[np.ndarray, "3"] | None, bodies: Bodies | None = None
    ) -> Evidence:
        """The same evidence with the evaluated method's own centroid [m] and bodies."""
        return replace(self, method_centroid_m=centroid_m, method_bodies=bodies)

    def lengthened(self, path_m: float) -> Evidence:
        """As if waves had travelled so much further to what changed and back [m]."""
        if path_m == 0.0:
            return self
        delta = self.delta * excess_turn(self.freq_hz, path_m)
        return replace(self, delta=delta.astype(np.complex64))

    @cached_property
    def maps(self) -> ThinnedMaps:
        """Power maps of the visible entries, computed once."""
        layout = self.layout
        pair, pairs = layout.pairs_of(self.link_visible)
        matched_filter = partial(matched_filter_map, self.delta_or_zero, layout, pair, self.freq_hz)
        return thinned_maps(self.power_map or matched_filter, pairs, self.freq_hz, self.grid)

    @property
    def delta_or_zero(self) -> Complex[np.ndarray, "tx rx subcarrier"]:
        """`delta` with zero in place of hidden entries."""
        return np.nan_to_num(self.delta, nan=0.0)


@dataclass(frozen=True)
class BaselineResult:
    """What a baseline says about a frame; what it cannot say is None, with the reason."""

    score: Float[np.ndarray, "x y z"] | None = None
    """Score per voxel."""
    delta: Complex[np.ndarray, "tx rx subcarrier"] | None = None
    """Prediction of csi − csi_static on every link and subcarrier."""
    static: Complex[np.ndarray, "tx rx subcarrier"] | None = None
    """Prediction of csi_static on every link and subcarrier."""
    reason: str = ""
    """Why something is None, for the report."""


#: A baseline turns the evidence of one frame into a result.
Baseline = Callable[[Evidence], BaselineResult]


#: Maps whose range cells are wider than this are computed on every second voxel only [m].
COARSE_RANGE_M = 0.15
#: Power of each device pair, (pair, N), at points (N, 3) [m].
PowerMap = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class ThinnedMaps:
    """Matched-filter power per device pair on a thinned grid."""

    power: Float[np.ndarray, "pair i j k"]
    """Power at the thinned voxel centres."""
    pairs: list[tuple[int, int]]
    """Transmitting and receiving device of each map."""
    grid: Grid
    """The full grid."""
    stride: int
    """Every how many voxels the map was computed."""

    @property
    def different(self) -> Bool[np.ndarray, "pair"]:
        """Which pairs are of two different devices."""
        return np.array([a != b for a, b in self.pairs], dtype=bool)

    def on_grid(self, thinned: Float[np.ndarray, "i j k"]) -> Float32[np.ndarray, "x y z"]:
        """Interpolates a combination of maps linearly to every voxel."""
        if self.stride == 1:
            return thinned.astype(np.float32)
        full = thinned
        for axis in range(3):
            weights = _interpolation(
                self.grid.axis_m(axis, self.stride), self.grid.axis_m(axis)
            ).astype(thinned.dtype)
            full = np.moveaxis(np.tensordot(weights, full, axes=(1, axis)), 0, axis)
        return full.astype(np.float32)


def _interpolation(
    known: Float[np.ndarray, "n"], wanted: Float[np.ndarray, "m"]
) -> Float[np.ndarray, "m n"]:
    """Matrix of linear interpolation from `known` to `wanted` coordinates."""
    return np.stack([np.interp(wanted, known, row) for row in np.eye(len(known))], axis=1)


def thinned_maps(
    power_map: PowerMap,
    pairs: list[tuple[int, int]],
    freq_hz: Float[np.ndarray, "subcarrier"],
    grid: Grid,
) -> ThinnedMaps:
    """Power of every device pair with a visible link.

    Args:
        power_map: Gives the power of each of `pairs` at points.
        pairs: Transmitting and receiving device of each row.
        freq_hz: Subcarrier frequencies [Hz].
        grid: Where to evaluate.
    """
    bandwidth_hz = float(freq_hz[-1] - freq_hz[0])
    stride = 2 if SPEED_OF_LIGHT / (2.0 * bandwidth_hz) > COARSE_RANGE_M else 1
    axes = [grid.axis_m(axis, stride) for axis in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    power = power_map(points.reshape(-1, 3))
    return ThinnedMaps(power.reshape(len(pairs), *points.shape[:3]), pairs, grid, stride)
