# SPDX-License-Identifier: Apache-2.0
"""Captures as pictures: level over time and bins, phases, delay and Doppler; before and after."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rfgs_core import sanitize
from rfgs_core.capture import Capture
from rfgs_core.figures.style import BASELINE, INK, METHOD, new_figure, write_picture
from rfgs_core.radio.levels import amplitude_decibels, decibels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Dynamic range of pictures of level [dB].
_RANGE_DB = 40.0
#: Most columns and rows of a picture; longer captures are thinned out.
_MOST_COLUMNS = 1200
#: Packets whose phases are drawn.
_PHASES = 40
#: Packets of which a spectrum of Doppler shifts is made.
_FEWEST_PACKETS = 64


def write_capture_chart(path: Path, capture: Capture) -> None:
    """Draws one capture: level over time, over bins, and what its axis allows beside them."""
    with new_figure(11.0, 6.0) as figure:
        axes = figure.subplots(2, 2)
        _waterfall(figure, axes[0, 0], capture)
        _levels(axes[0, 1], capture)
        _phases(axes[1, 0], capture)
        _delays_or_power(axes[1, 1], capture)
        write_picture(figure, path)


def write_sanitised_chart(path: Path, before: Capture, after: Capture) -> None:
    """Draws a capture before (left) and after (right) sanitisation."""
    doppler = after.rate_hz > 20.0 and len(after) >= _FEWEST_PACKETS
    with new_figure(11.0, 9.0 if doppler else 6.0) as figure:
        axes = figure.subplots(3 if doppler else 2, 2)
        for column, (name, capture) in enumerate((("before", before), ("after", after))):
            _waterfall(figure, axes[0, column], capture)
            _phases(axes[1, column], capture)
            axes[0, column].set_title(f"{name}: {axes[0, column].get_title()}")
            if doppler:
                _doppler(figure, axes[2, column], capture if column else _as_clocked(before, after))
        write_picture(figure, path)


def _waterfall(figure: Figure, axis: Axes, capture: Capture) -> None:
    """Level of the strongest link over time and bins."""
    device, rx, tx = _strongest(capture)
    keep = np.linspace(0, len(capture) - 1, min(len(capture), _MOST_COLUMNS)).astype(int)
    level_db = amplitude_decibels(np.abs(capture.values[keep, device, rx, tx]))
    top = float(np.percentile(level_db, 99.5))
    x, _ = _bins(capture)
    image = axis.imshow(
        level_db.T,
        aspect="auto",
        origin="lower",
        cmap="magma",
        vmin=top - _RANGE_DB,
        vmax=top,
        extent=(0.0, max(float(capture.time_s[-1]), 1e-3), x[0], x[-1] if len(x) > 1 else x[0] + 1),
    )
    counted = "packet" if capture.info.get("untimed") else "time [s]"
    axis.set(title=f"level [dB], RX {rx}, TX {tx}", xlabel=counted, ylabel=_bins(capture)[1])
    figure.colorbar(image, ax=axis, shrink=0.8).outline.set_visible(False)  # type: ignore[operator]


def _levels(axis: Axes, capture: Capture) -> None:
    """Median level of every link over bins, with the middle 80 % of the strongest."""
    x, label = _bins(capture)
    strongest = _strongest(capture)
    for device, rx, tx in np.ndindex(*capture.values.shape[1:4]):
        mask = capture.valid[:, device, rx, tx]
        if not mask.any():
            continue
        level_db = amplitude_decibels(np.abs(capture.values[:, device, rx, tx]))
        seen = mask.any(axis=0)
        best = (device, rx, tx) == strongest
        colour = METHOD if best else BASELINE
        low, middle, high = np.percentile(level_db, [10, 50, 90], axis=0)
        style = "." if len(x) == 1 else "-"
        axis.plot(x[seen], middle[seen], style, lw=1.2, color=colour, alpha=1.0 if best else 0.6)
        if best:
            axis.fill_between(x, low, high, color=METHOD, alpha=0.18, lw=0, where=seen)
    axis.set(title="median level of every link [dB]", xlabel=label)
    axis.grid(color=INK, alpha=0.25, lw=0.6)


def _phases(axis: Axes, capture: Capture) -> None:
    """Phases of some packets of the strongest link over bins."""
    device, rx, tx = _strongest(capture)
    x, label = _bins(capture)
    keep = np.linspace(0, len(capture) - 1, min(len(capture), _PHASES)).astype(int)
    values = capture.values[keep, device, rx, tx]
    if capture.axis == "subcarrier" and len(x) > 1:
        phase = sanitize.unwrap(values, capture.index)[0]
        # Whole turns between packets say nothing.
        phase -= 2 * np.pi * np.round(phase.mean(axis=1, keepdims=True) / (2 * np.pi))
        axis.plot(x, phase.T, lw=0.7, color=METHOD, alpha=0.4)
        axis.set(title=f"phase of {len(keep)} packets [rad]", xlabel=label)
    else:
        strongest = int(np.abs(capture.values[:, device, rx, tx]).mean(axis=0).argmax())
        phase = np.angle(capture.values[:, device, rx, tx, strongest])
        axis.plot(capture.time_s, phase, ".", ms=2.0, color=METHOD)
        axis.set(title=f"phase at {x[strongest]:.4g} ({label}) [rad]", xlabel="time [s]")
    axis.grid(color=INK, alpha=0.25, lw=0.6)


def _delays_or_power(axis: Axes, capture: Capture) -> None:
    """Mean delay profile over subcarriers; the level of packets where there is none."""
    device, rx, tx = _strongest(capture)
    values = capture.values[:, device, rx, tx]
    if capture.axis == "subcarrier" and len(capture.bins) > 1:
        spacing_hz = (capture.bins[-1] - capture.bins[0]) / (capture.index[-1] - capture.index[0])
        keep = np.linspace(0, len(values) - 1, min(len(values), 500)).astype(int)
        delay_s, profile = sanitize.windowed_profile(values[keep], capture.index, float(spacing_hz))
        power = (np.abs(profile) ** 2).mean(axis=0)
        # Timing is arbitrary: the strongest arrival stands at a tenth of the period.
        shift = len(power) // 10 - int(power.argmax())
        level_db = decibels(np.roll(power, shift) / power.max())
        delay_ns = 1e9 * (delay_s - delay_s[len(power) // 10])
        axis.plot(delay_ns, level_db, lw=1.2, color=METHOD)
        axis.set(title="mean delay profile [dB]", xlabel="delay after the strongest [ns]")
        axis.set(xlim=(-200.0, min(1500.0, delay_ns[-1])), ylim=(-_RANGE_DB, 2.0))
    else:
        level_db = decibels((np.abs(values) ** 2).mean(axis=-1))
        axis.plot(capture.time_s, level_db, lw=0.8, color=METHOD)
        axis.set(title="mean level of packets [dB]", xlabel="time [s]")
    axis.grid(color=INK, alpha=0.25, lw=0.6)


def _doppler(figure: Figure, axis: Axes, capture: Capture) -> None:
    """Doppler shifts over time; of several antennas by conjugate products."""
    device, rx, tx = _strongest(capture)
    values = capture.values[:, device, :, tx].astype(np.complex128)
    used = np.flatnonzero(values.any(axis=(0, 2)))
    rate_hz = capture.rate_hz
    if len(used) > 1:
        reference = sanitize.reference_antenna(values[:, used])
        shifted = sanitize.adjust_amplitudes(values[:, used], reference)
        links = sanitize.conjugate_product(shifted, reference)
    else:
        links = values[:, [rx]]
    high_hz = min(60.0, 0.45 * rate_hz)
    kept = sanitize.doppler_band(links.reshape(len(links), -1), rate_hz, 2.0, high_hz)
    freq_hz, time_s, power = sanitize.doppler_spectrum(sanitize.first_component(kept), rate_hz)
    shown = np.abs(freq_hz) <= high_hz
    level_db = decibels(power[shown] / max(float(power.max()), 1e-300))
    image = axis.imshow(
        level_db,
        aspect="auto",
        origin="lower",
        cmap="magma",
        vmin=-25.0,
        extent=(time_s[0], time_s[-1], freq_hz[shown][0], freq_hz[shown][-1]),
    )
    axis.set(title="Doppler [dB]", xlabel="time [s]", ylabel="shift [Hz]")
    figure.colorbar(image, ax=axis, shrink=0.8).outline.set_visible(False)  # type: ignore[operator]


def _as_clocked(before: Capture, after: Capture) -> Capture:
    """The raw capture at the ticks of the cleaned one, for the same transforms."""
    nearest, _ = sanitize.resample(np.arange(len(before)), before.time_s, after.time_s, "nearest")
    return replace(before.select(nearest), time_s=after.time_s)


def _strongest(capture: Capture) -> tuple[int, int, int]:
    """Device, RX and TX of the loudest link."""
    power = (np.abs(capture.values) ** 2).mean(axis=(0, 4))
    device, rx, tx = np.unravel_index(int(power.argmax()), power.shape)
    return int(device), int(rx), int(tx)


def _bins(capture: Capture) -> tuple[np.ndarray, str]:
    """Bins in units for people, and what they are."""
    if capture.axis == "subcarrier":
        centre = capture.centre_hz or 0.0
        label = "frequency [MHz]" if centre else "offset from the centre [MHz]"
        return (capture.bins + centre) / 1e6, label
    if capture.axis == "delay":
        return capture.bins * 1e9, "delay [ns]"
    if capture.axis == "range":
        return capture.bins, "range [m]"
    return capture.bins, "direction (elevation · 360 + azimuth)"
