# SPDX-License-Identifier: Apache-2.0
"""What a baseline may look at: one frame without the held-out entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Bool, Complex, Float

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.dataset.splits import HeldOut
from rfgs_core.encode.matched_filter import matched_filter_map
from rfgs_core.evaluate.backprojection import PowerMap, ThinnedMaps, thinned_maps
from rfgs_core.evaluate.grid import Grid
from rfgs_core.measure.observations import excess_turn
from rfgs_core.radio import Layout


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
