# SPDX-License-Identifier: Apache-2.0
"""What a control may look at: one frame without the held-out entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from rfgs_core.evaluate.grid import Grid
from rfgs_core.evaluate.rf import HeldOut


@dataclass(frozen=True)
class Antennas:
    """Where the elements of a radio are and which tones it measures."""

    tx_xyz: Float[np.ndarray, "tx 3"]
    """Transmitting elements [m]."""
    rx_xyz: Float[np.ndarray, "rx 3"]
    """Receiving elements [m]."""
    tx_device: Int[np.ndarray, "tx"]
    """Device of each transmitting element."""
    rx_device: Int[np.ndarray, "rx"]
    """Device of each receiving element."""
    rx_column: Int[np.ndarray, "rx"]
    """Array column of each receiving element within its device."""
    measured: Bool[np.ndarray, "tx rx"]
    """Links that the radio measures."""
    freq_hz: Float[np.ndarray, "subcarrier"]
    """Tone frequencies [Hz], equally spaced."""


@dataclass(frozen=True)
class Evidence:
    """One frame as training sees it; hidden entries are NaN, so that reading one shows."""

    delta: Complex[np.ndarray, "tx rx subcarrier"]
    """csi − csi_static; NaN where held out or not measured."""
    static: Complex[np.ndarray, "tx rx subcarrier"]
    """csi_static; NaN where held out or not measured."""
    antennas: Antennas
    """Geometry of the radio."""
    link_visible: Bool[np.ndarray, "tx rx"]
    """Links with at least one visible tone."""
    tone_visible: Bool[np.ndarray, "subcarrier"]
    """Tones that are not held out."""
    grid: Grid
    """Grid to score."""
    voxels: int
    """Number of voxels a prediction has."""
    method_centroid_m: Float[np.ndarray, "3"] | None = None
    """Centroid of the evaluated method's own prediction [m]; None if it predicts nothing."""

    @staticmethod
    def hide(
        csi: Complex[np.ndarray, "tx rx subcarrier"],
        csi_static: Complex[np.ndarray, "tx rx subcarrier"],
        held_out: HeldOut,
        antennas: Antennas,
        grid: Grid,
        voxels: int,
    ) -> Evidence:
        """Evidence of one frame: everything that is not visible becomes NaN."""
        visible = held_out.visible
        hidden = np.complex64(complex(np.nan, np.nan))
        return Evidence(
            delta=np.where(visible, csi - csi_static, hidden).astype(np.complex64),
            static=np.where(visible, csi_static, hidden).astype(np.complex64),
            antennas=antennas,
            link_visible=visible.any(axis=2),
            tone_visible=visible.any(axis=(0, 1)),
            grid=grid,
            voxels=voxels,
        )

    def with_centroid(self, centroid_m: Float[np.ndarray, "3"] | None) -> Evidence:
        """The same evidence with the evaluated method's own centroid [m]."""
        return replace(self, method_centroid_m=centroid_m)

    @property
    def delta_or_zero(self) -> Complex[np.ndarray, "tx rx subcarrier"]:
        """`delta` with zero in place of hidden entries."""
        return np.nan_to_num(self.delta, nan=0.0)


@dataclass(frozen=True)
class ControlResult:
    """What a control says about a frame; what it cannot say is None, with the reason."""

    score: Float[np.ndarray, "x y z"] | None = None
    """Score per voxel."""
    delta: Complex[np.ndarray, "tx rx subcarrier"] | None = None
    """Prediction of csi − csi_static on every link and tone."""
    static: Complex[np.ndarray, "tx rx subcarrier"] | None = None
    """Prediction of csi_static on every link and tone."""
    reason: str = ""
    """Why something is None, for the report."""


#: A control turns the evidence of one frame into a result.
Control = Callable[[Evidence], ControlResult]
