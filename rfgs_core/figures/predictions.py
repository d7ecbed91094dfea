# SPDX-License-Identifier: Apache-2.0
"""A picture of predicted channels: delay profile and spatial spectrum of every receiver."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rfgs_core.figures.style import INK, METHOD, TRUTH, new_figure, power_colours, write_picture
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.levels import amplitude_decibels, decibels

#: Powers this far below the strongest are not drawn [dB].
RANGE_DB = 40.0


def write_prediction_chart(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Draws delay profiles and spatial spectra, one row per receiver, into a PNG.

    Args:
        path: The picture.
        arrays: As of `rfgs_core.predict.arrays.prediction_arrays`.
    """
    count = len(arrays["rx_xyz"])
    with new_figure(10.0, 2.9 * count) as figure:
        axes = figure.subplots(count, 2, squeeze=False, width_ratios=(3, 4))
        for index, (left, right) in enumerate(axes):
            _draw_profile(left, arrays, index)
            _draw_spectrum(right, arrays, index)
        write_picture(figure, path)


def _draw_profile(axes, arrays: Mapping[str, np.ndarray], index: int) -> None:
    delay_ns = arrays["delay_s"] * 1e9
    straight_m = float(np.linalg.norm(arrays["rx_xyz"][index] - arrays["tx_xyz"]))
    far_ns = max(3 * straight_m / SPEED_OF_LIGHT, 1.5 * arrays["gaussian_delay_s"][index].max())
    shown = delay_ns <= far_ns * 1e9
    for name, colour, label in (
        ("profile", TRUTH, "with the direct path"),
        ("profile_scatter", METHOD, "person's scattering"),
    ):
        level_db = amplitude_decibels(arrays[name][index], least=1e-12)
        axes.plot(delay_ns[shown], level_db[shown], color=colour, label=label, linewidth=1.2)
    axes.axvline(straight_m / SPEED_OF_LIGHT * 1e9, color=INK, linewidth=0.6, linestyle=":")
    top = amplitude_decibels(float(arrays["profile"][index].max()), least=1e-12)
    axes.set(
        title=f"delay profile at {_place(arrays['rx_xyz'][index])}",
        xlabel="delay [ns]; dotted: the straight way",
        ylabel="amplitude [dB]",
        ylim=(top - 2 * RANGE_DB, top + 3),
    )
    axes.legend(loc="best")


def _draw_spectrum(axes, arrays: Mapping[str, np.ndarray], index: int) -> None:
    name = "beam_power" if "beam_power" in arrays else "arrival_power"
    power = arrays[name][index]
    level_db = decibels(power)
    top = float(np.nanmax(level_db))
    level_db = np.where(level_db < top - RANGE_DB, np.nan, level_db)
    colours = power_colours()
    picture = axes.imshow(
        level_db,
        extent=(-180, 180, -90, 90),
        origin="lower",
        aspect="auto",
        cmap=colours,
        vmin=top - RANGE_DB,
        vmax=top,
        interpolation="nearest",
    )
    towards = arrays["tx_xyz"] - arrays["rx_xyz"][index]
    azimuth = np.rad2deg(np.arctan2(towards[1], towards[0]))
    elevation = np.rad2deg(np.arcsin(towards[2] / np.linalg.norm(towards)))
    axes.plot(azimuth, elevation, marker="x", color=INK, markersize=6)
    how = "beams of the array" if name == "beam_power" else "by direction of arrival"
    axes.set(
        title=f"scattered power, {how}",
        xlabel="azimuth [°]; ×: direction of the transmitter",
        ylabel="elevation [°]",
        xticks=range(-180, 181, 60),
        yticks=range(-90, 91, 30),
    )
    axes.figure.colorbar(picture, ax=axes, label="dB")


def _place(xyz: np.ndarray) -> str:
    return ", ".join(f"{value:g}" for value in np.round(xyz, 3)) + " m"
