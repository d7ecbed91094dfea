# SPDX-License-Identifier: Apache-2.0
"""Plots of a synthetic aperture: range profiles along it, and images focused by back-projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from dataset_factory.preview.channels import RANGE_DB, responses
from dataset_factory.preview.strips import MARGINS, WIDTH_IN, Timeline
from rfgs_core.dataset import Sequence
from rfgs_core.encode.matched_filter import aperture_filter
from rfgs_core.radio.delay import hann_to_zero
from rfgs_core.radio.levels import decibels

#: Cells of the images [m]: across, and from height to height.
CELL_M = 0.03
STEP_M = 0.1
#: Heights above the floor that images span [m].
SPAN_M = (0.2, 1.9)
#: Dynamic range of images of the change [dB].
CHANGE_RANGE_DB = 20.0
#: A bound on the cells of one image; in larger scenes they grow.
MOST_CELLS = 400_000

_MARK: dict[str, Any] = {"color": "#4dd2ff", "ls": "none", "marker": "x", "ms": 7, "mew": 1.6}


@dataclass(frozen=True)
class Aperture:
    """Everything about the places of a radio whose antennas move."""

    tx_xyz: np.ndarray
    """Transmitting antenna at each place [m], shape (sample, 3)."""
    rx_xyz: np.ndarray
    """Receiving antenna at each place [m], shape (sample, 3)."""
    freq_hz: np.ndarray
    """Subcarriers [Hz]."""

    @staticmethod
    def of(sequence: Sequence, radio: str) -> Aperture:
        """The first elements of the radio's arrays."""
        count = sequence.radio_spec(radio).samples_per_frame
        data = sequence.radio(radio)
        tx_xyz, rx_xyz = (data[name].values[:count, 0] for name in ("tx_xyz", "rx_xyz"))
        return Aperture(tx_xyz, rx_xyz, sequence.radio_spec(radio).freq_hz)

    def image(self, pulses: np.ndarray, axes_m: list[np.ndarray]) -> np.ndarray:
        """Power (x, y, z) that the matched filter finds, from channels (sample, subcarrier).

        Subcarriers are weighted with a Hann window, or the straight way from antenna to antenna
        would show everywhere.
        """
        grid = np.stack(np.meshgrid(*axes_m, indexing="ij"), axis=-1)
        window = hann_to_zero(len(self.freq_hz))
        found = aperture_filter(
            (pulses * window / window.mean()).astype(np.complex64),
            self.tx_xyz,
            self.rx_xyz,
            self.freq_hz,
            grid.reshape(-1, 3),
        )
        return (np.abs(found) ** 2).reshape(grid.shape[:3])


def aperture_strip(sequence: Sequence, radio: str, timeline: Timeline) -> Figure:
    """The change of the scene from above, focused, under each picture of the strip."""
    aperture, axes_m = Aperture.of(sequence, radio), image_axes(sequence)
    static = sequence.csi_static_samples(radio)[:, 0, 0]
    left, right = MARGINS
    slot = (right - left) / len(timeline.shown)
    wide, deep = (axis[-1] - axis[0] for axis in axes_m[:2])
    tall = min(WIDTH_IN * slot * 0.92 * deep / wide, 4.0)
    figure = Figure(figsize=(WIDTH_IN, tall + 0.6))
    for column, frame in enumerate(timeline.shown):
        change = sequence.csi_samples(radio, frame)[:, 0, 0] - static
        level = decibels(aperture.image(change, axes_m).max(axis=2))
        where = (left + (column + 0.04) * slot, 0.45 / (tall + 0.6), 0.92 * slot)
        axis = figure.add_axes((*where, tall / (tall + 0.6)))
        _from_above(axis, sequence, aperture, level, axes_m)
        _people(axis, sequence, frame, 0, 1)
        axis.set_xlabel(f"frame {frame}, x [m]", fontsize=7)
        axis.tick_params(labelsize=6, length=2, labelleft=column == 0)
        if column == 0:
            axis.set_ylabel("y [m]", fontsize=8)
    return figure


def range_figure(sequence: Sequence, radio: str, frame: int) -> Figure:
    """Range profiles along the aperture with people, static, and of the difference."""
    csi = sequence.csi_samples(radio, frame)[:, 0, 0]
    static = sequence.csi_static_samples(radio)[:, 0, 0]
    aperture = Aperture.of(sequence, radio)
    figure = Figure(figsize=(12, 4.2), layout="constrained")
    axes = figure.subplots(1, 3, sharex=True, sharey=True)
    kinds = ("with people", "static", "difference")
    for axis, value, title in zip(axes, (csi, static, csi - static), kinds, strict=True):
        profile, length_m = responses(sequence, radio, value)
        level = decibels(np.abs(profile) ** 2).T
        # The straight way from antenna to antenna would hide the room.
        top = level[length_m > 1.0].max()
        shown = axis.pcolormesh(
            np.arange(len(value)),
            0.5 * length_m,
            level,
            shading="nearest",
            cmap="inferno",
            vmin=top - RANGE_DB,
            vmax=top,
            rasterized=True,
        )
        figure.colorbar(shown, ax=axis, pad=0.01, label="dB").ax.tick_params(labelsize=7)
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("place along the aperture")
    for joints in sequence.joints(frame):
        out = np.linalg.norm(aperture.tx_xyz - joints[0], axis=1)
        back = np.linalg.norm(aperture.rx_xyz - joints[0], axis=1)
        axes[2].plot(0.5 * (out + back), color="#4dd2ff", lw=1.0, ls=(0, (4, 3)))
    axes[0].set_ylabel("range [m]")
    return figure


def image_figure(sequence: Sequence, radio: str, frame: int) -> Figure:
    """What people change, focused: from above, along y and along x."""
    aperture, axes_m = Aperture.of(sequence, radio), image_axes(sequence)
    static = sequence.csi_static_samples(radio)[:, 0, 0]
    change = sequence.csi_samples(radio, frame)[:, 0, 0] - static
    power = aperture.image(change, axes_m)
    figure = Figure(figsize=(12, 4.2), layout="constrained")
    axes = figure.subplots(1, 3)
    for axis, (across, up) in zip(axes, ((0, 1), (0, 2), (1, 2)), strict=True):
        level = decibels(power.max(axis=3 - across - up))
        if up == 1:
            shown = _from_above(axis, sequence, aperture, level, axes_m)
        else:
            shown = _draw(axis, axes_m[across], axes_m[up], level)
        figure.colorbar(shown, ax=axis, pad=0.01).ax.tick_params(labelsize=7)
        _people(axis, sequence, frame, across, up)
        axis.set(xlabel=f"{'xyz'[across]} [m]", ylabel=f"{'xyz'[up]} [m]")
        axis.set_title(f"change, along {'xyz'[3 - across - up]} [dB]", fontsize=9)
    return figure


def image_axes(sequence: Sequence) -> list[np.ndarray]:
    """Centres of the image's cells along x, y and z [m]."""
    low, high = sequence.bounds_m
    heights = np.arange(low[2] + SPAN_M[0], min(low[2] + SPAN_M[1], high[2]) + 1e-9, STEP_M)
    room = float(np.prod((high - low)[:2])) * len(heights)
    cell = max(CELL_M, np.sqrt(room / MOST_CELLS))
    across = [np.arange(low[axis] + 0.5 * cell, high[axis], cell) for axis in (0, 1)]
    return [*across, heights]


def _from_above(
    axis: Any,
    sequence: Sequence,
    aperture: Aperture,
    level: np.ndarray,
    axes_m: list[np.ndarray],
) -> Any:
    """Draws a level (x, y) with the antenna's places."""
    shown = _draw(axis, axes_m[0], axes_m[1], level)
    axis.plot(*aperture.rx_xyz[:, :2].T, ".", color="#8a94a3", ms=1.5)
    low, high = sequence.bounds_m
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    return shown


def _draw(axis: Any, x: np.ndarray, y: np.ndarray, level: np.ndarray) -> Any:
    top = level.max()
    return axis.pcolormesh(
        x,
        y,
        level.T,
        shading="nearest",
        cmap="inferno",
        vmin=top - CHANGE_RANGE_DB,
        vmax=top,
        rasterized=True,
    )


def _people(axis: Any, sequence: Sequence, frame: int, across: int, up: int) -> None:
    """Crosses where the pelvis of each person is; NaN draws nothing."""
    pelvis = sequence.joints(frame)[:, 0]
    axis.plot(pelvis[:, across], pelvis[:, up], **_MARK)
