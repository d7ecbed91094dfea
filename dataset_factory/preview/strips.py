# SPDX-License-Identifier: Apache-2.0
"""Strips over time: pictures, labels and channels on one axis, to be read together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from dataset_factory.preview.arrays import delay_image, draw_scatterer, has_beam
from dataset_factory.preview.panels import (
    Watch,
    amplitude_panel,
    angle_panel,
    delay_panel,
    doppler_panel,
    doppler_shown,
)
from dataset_factory.preview.pictures import over_backdrop
from rfgs_core.dataset import Sequence
from rfgs_core.radio.levels import decibels

#: Left and right end of the time axis in every strip, as shares of its width.
MARGINS = (0.085, 0.93)
WIDTH_IN = 12.0
#: Pictures, and delay images under them, across a strip.
MOST_ACROSS = 8
MOST_CAMERAS = 2
#: Height of a panel and of the gap below it [in].
PANEL_IN = 1.25
GAP_IN = 0.16

TIME_LABEL = "time [s]"

_INK = "#39424f"
_LABEL_COLOURS = ("#3d7edb", "#d9722e", "#2e9e6b", "#a25bc4", "#c9a227", "#c24b6e")


@dataclass(frozen=True)
class Timeline:
    """When frames are, and which of them stand for a stretch of time."""

    start_s: float
    """Left end of every strip [s]."""
    end_s: float
    """Right end [s]."""
    shown: list[int]
    """Frames whose pictures are shown, evenly spread."""
    half_s: float
    """Half the time from one frame to the next [s]."""

    @staticmethod
    def of(sequence: Sequence) -> Timeline:
        """The time axis of a sequence: where the data of its radios begin and end."""
        times = [sequence.time_s(frame) for frame in sequence.frames]
        half = 0.5 * float(min(np.diff(times)) if len(times) > 1 else 1.0 / sequence.fps)
        spans = [_span_s(sequence, radio, half) for radio in sequence.radios]
        start = min((span[0] for span in spans), default=times[0] - half)
        end = max((span[1] for span in spans), default=times[-1] + half)
        across = min(MOST_ACROSS, len(times))
        centres = start + (np.arange(across) + 0.5) * (end - start) / across
        nearest = [int(np.abs(np.array(times) - centre).argmin()) for centre in centres]
        return Timeline(start, end, [sequence.frames[index] for index in nearest], half)


def _span_s(sequence: Sequence, radio: str, half_s: float) -> tuple[float, float]:
    """When a radio's samples begin and end [s]; the only one of a frame lasts as long as it."""
    ends = [sequence.sample_times_s(radio, sequence.frames[index]) for index in (0, -1)]
    if len(ends[0]) > 1 and ends[0][1] > ends[0][0]:
        half_s = 0.5 * float(ends[0][1] - ends[0][0])
    return float(ends[0][0]) - half_s, float(ends[1][-1]) + half_s


def picture_strip(sequence: Sequence, timeline: Timeline) -> Figure:
    """Pictures of up to two cameras, spread over time, above a band of each person's action."""
    cameras = sequence.cameras[:MOST_CAMERAS]
    across, (left, right) = len(timeline.shown), MARGINS
    slot = (right - left) / across
    rows = [WIDTH_IN * slot * 0.96 * row["height"] / row["width"] for row in cameras]
    band = 0.72
    height = sum(rows) + 0.06 * len(rows) + band
    figure = Figure(figsize=(WIDTH_IN, height))
    top = 1.0
    for row, tall in zip(cameras, rows, strict=True):
        top -= tall / height
        for column, frame in enumerate(timeline.shown):
            where = (left + (column + 0.02) * slot, top, 0.96 * slot, tall / height)
            axis = figure.add_axes(where)
            axis.imshow(over_backdrop(sequence.image(row["name"], frame)))
            axis.axis("off")
        figure.text(left - 0.01, top + 0.5 * tall / height, row["name"], ha="right", va="center")
        top -= 0.06 / height
    axis = figure.add_axes((left, 0.45 / height, right - left, 0.2 / height))
    _action_band(axis, sequence, timeline)
    return figure


def _action_band(axis: Any, sequence: Sequence, timeline: Timeline) -> None:
    """What each person does over time, and ticks where the pictures above were taken."""
    half = timeline.half_s
    rows = [sequence.actions(frame) for frame in sequence.frames]
    names = sorted({action for row in rows for action in row})
    for person in range(max(map(len, rows), default=0)):
        begin = 0
        done = [row[person] if person < len(row) else "" for row in rows]
        for index in range(1, len(done) + 1):
            if index < len(done) and done[index] == done[begin]:
                continue
            first = sequence.time_s(sequence.frames[begin]) - half
            last = sequence.time_s(sequence.frames[index - 1]) + half
            colour = _LABEL_COLOURS[names.index(done[begin]) % len(_LABEL_COLOURS)]
            axis.barh(-person, last - first, left=first, height=0.9, color=colour)
            if (last - first) > 0.06 * (timeline.end_s - timeline.start_s):
                text = done[begin] or "no label"
                axis.text(
                    0.5 * (first + last),
                    -person,
                    text,
                    ha="center",
                    va="center",
                    color="white",
                    fontsize=8,
                )
            begin = index
    for frame in timeline.shown:
        axis.axvline(sequence.time_s(frame), ymin=1.0, ymax=1.3, color=_INK, lw=1, clip_on=False)
    axis.set(xlim=(timeline.start_s, timeline.end_s), yticks=[])
    axis.set_ylabel("action", rotation=0, ha="right", va="center", fontsize=8)
    axis.set_xlabel(TIME_LABEL, fontsize=8, labelpad=2)
    axis.spines[:].set_visible(False)
    axis.tick_params(labelsize=7, length=2)


def channel_strip(sequence: Sequence, radio: str, timeline: Timeline, seen: Watch) -> Figure:
    """Amplitude, delay, angle and Doppler over time, and delay images under the pictures."""
    beam = has_beam(sequence, radio)
    panels = [amplitude_panel, delay_panel, *([angle_panel] if beam else [])]
    panels += [doppler_panel] if doppler_shown(sequence, radio) else []
    left, right = MARGINS
    square = min(WIDTH_IN * (right - left) / len(timeline.shown), 1.6)
    total = len(panels) * (PANEL_IN + GAP_IN) + square + 0.9
    figure = Figure(figsize=(WIDTH_IN, total))
    top = total - 0.05
    for panel in panels:
        top -= PANEL_IN
        axis = figure.add_axes((left, top / total, right - left, PANEL_IN / total))
        scale = figure.add_axes((right + 0.008, top / total, 0.008, PANEL_IN / total))
        shown = panel(axis, sequence, radio, seen)
        figure.colorbar(shown, cax=scale).ax.tick_params(labelsize=6, length=2)
        axis.set_xlim(timeline.start_s, timeline.end_s)
        axis.tick_params(labelsize=7, length=2, labelbottom=panel is panels[-1])
        top -= GAP_IN
    axis.set_xlabel(TIME_LABEL, fontsize=8, labelpad=2)
    _image_row(figure, sequence, radio, timeline, seen, (0.42 / total, square / total))
    return figure


def _image_row(
    figure: Figure,
    sequence: Sequence,
    radio: str,
    timeline: Timeline,
    seen: Watch,
    place: tuple[float, float],
) -> None:
    """One delay image of the change under each picture of the strip."""
    (left, right), (bottom, tall) = MARGINS, place
    slot, static = (right - left) / len(timeline.shown), sequence.csi_static(radio)
    beam = has_beam(sequence, radio)
    for column, frame in enumerate(timeline.shown):
        change = sequence.csi(radio, frame) - static
        power, across, length_m = delay_image(sequence, radio, change, seen.pair)
        level = decibels(power)
        axis = figure.add_axes((left + (column + 0.04) * slot, bottom, 0.92 * slot, tall))
        axis.pcolormesh(
            across,
            length_m,
            level.T,
            shading="nearest",
            cmap="inferno",
            vmin=level.max() - 20.0,
            vmax=level.max(),
            rasterized=True,
        )
        for joints in sequence.joints(frame):
            draw_scatterer(axis, sequence, radio, seen.pair, joints[0])
        if beam:
            axis.set_xticks([-60, 0, 60])
        axis.set_xlabel(f"frame {frame}, {'angle [°]' if beam else 'antenna [m]'}", fontsize=7)
        axis.tick_params(labelsize=6, length=2, labelleft=column == 0)
        if column == 0:
            axis.set_ylabel("path length\n[m]", fontsize=8)
