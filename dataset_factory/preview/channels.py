# SPDX-License-Identifier: Apache-2.0
"""Plots of a sequence's channels: amplitude, delay, and delay over each array."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from dataset_factory.preview.arrays import (
    across_label,
    delay_image,
    draw_scatterer,
    responses,
)
from rfgs_core.dataset import Sequence
from rfgs_core.radio import Layout
from rfgs_core.radio.levels import decibels

#: Dynamic range of images [dB].
RANGE_DB = 40.0
#: Dynamic range of delay profiles [dB].
PROFILE_RANGE_DB = 110.0

_KINDS = ("with people", "static", "difference")
_COLOURS = ("#0b6bcb", "#8a94a3", "#d9480f")


def profile_figure(sequence: Sequence, radio: str, frame: int) -> Figure:
    """Amplitude image above delay profiles of up to eight device pairs."""
    csi, static = sequence.csi(radio, frame), sequence.csi_static(radio)
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    pairs = layout.device_pairs[:8]
    rows = -(-len(pairs) // 4)
    figure = Figure(figsize=(12, 3.0 + 2.2 * rows), layout="constrained")
    grid = figure.add_gridspec(rows + 1, 4, height_ratios=[1.2, *([1] * rows)])
    axis = figure.add_subplot(grid[0, :])
    rms = np.sqrt((np.abs(csi) ** 2).sum(0) / np.maximum(layout.measured.sum(0), 1)[:, None])
    shown = axis.imshow(
        decibels(rms**2),
        aspect="auto",
        extent=(spec.freq_min_hz / 1e9, spec.freq_max_hz / 1e9, len(rms) - 0.5, -0.5),
    )
    axis.set(xlabel="frequency [GHz]", ylabel="receiving element")
    figure.colorbar(shown, ax=axis, label="amplitude [dB]", pad=0.01)
    first, top = None, -np.inf
    for index, (a, b) in enumerate(pairs):
        axis = figure.add_subplot(grid[1 + index // 4, index % 4], sharex=first, sharey=first)
        first = first or axis
        _profiles(axis, sequence, radio, (a, b), (csi, static, csi - static))
        top = max(top, *(np.max(np.asarray(line.get_ydata())) for line in axis.lines[:3]))
        axis.set_ylim(top - PROFILE_RANGE_DB, top + 5.0)
        if index == 0:
            axis.legend(fontsize=7, loc="upper right")
    return figure


def delay_image_figure(sequence: Sequence, radio: str, frame: int) -> Figure:
    """Delay images of each receiving device (rows) with people, static, difference."""
    csi, static = sequence.csi(radio, frame), sequence.csi_static(radio)
    layout = sequence.layout(radio)
    pairs = _listening_pairs(layout)[:4]
    figure = Figure(figsize=(12, 2.7 * len(pairs)), layout="constrained")
    axes = figure.subplots(len(pairs), 3, squeeze=False, sharex=True, sharey=True)
    for row, (a, b) in zip(axes, pairs, strict=True):
        for axis, value, title in zip(row, (csi, static, csi - static), _KINDS, strict=True):
            power, across, length_m = delay_image(sequence, radio, value, (a, b))
            level = decibels(power)
            # A device's own transmitter is so near that it would hide the room.
            top = level[:, length_m > (1.0 if a == b else 0.0)].max()
            shown = axis.imshow(
                level.T,
                origin="lower",
                aspect="auto",
                extent=(across[0], across[-1], 0.0, length_m[-1]),
                vmin=top - RANGE_DB,
                vmax=top,
                cmap="inferno",
            )
            figure.colorbar(shown, ax=axis, pad=0.01).ax.tick_params(labelsize=7)
            axis.set_title(f"device {a} to {b}, {title}", fontsize=9)
            pelvis = sequence.joints(frame)[:, 0]
            for point in pelvis[np.isfinite(pelvis).all(axis=1)]:
                draw_scatterer(axis, sequence, radio, (a, b), point)
        row[0].set_ylabel("path length [m]")
    for axis in axes[-1]:
        axis.set_xlabel(across_label(sequence, radio))
    return figure


def _profiles(
    axis, sequence: Sequence, radio: str, pair: tuple[int, int], values: tuple[np.ndarray, ...]
) -> None:
    layout = sequence.layout(radio)
    block = layout.block_of(*pair)
    for value, name, colour in zip(values, _KINDS, _COLOURS, strict=True):
        profile, length_m = responses(sequence, radio, value[block])
        power = (np.abs(profile) ** 2).mean(axis=(0, 1))
        axis.plot(length_m, decibels(power), color=colour, lw=1.2, label=name)
    direct = np.linalg.norm(np.subtract(*layout.centres_of(*pair)))
    axis.axvline(direct, color="#444", ls=":", lw=1)
    axis.set_title(f"device {pair[0]} to {pair[1]}", fontsize=9)
    axis.set_xlabel("path length [m]", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.grid(alpha=0.25)


def _listening_pairs(layout: Layout) -> list[tuple[int, int]]:
    """For each receiving device one transmitting device, another one where that is measured."""
    chosen: dict[int, tuple[int, int]] = {}
    count = int(layout.rx_device.max()) + 1
    for a, b in sorted(layout.device_pairs, key=lambda pair: (pair[0] - pair[1] - 1) % count):
        chosen.setdefault(b, (a, b))
    return [chosen[b] for b in sorted(chosen)]
