# SPDX-License-Identifier: Apache-2.0
"""A picture of one link: what was measured and what a run predicts, over its frames."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Complex64

from rfgs_core.dataset.aperture import whole_csi, whole_layout, whole_static
from rfgs_core.errors import RfgsError
from rfgs_core.figures.radio import PADDING, RANGE_DB, padded_profile
from rfgs_core.figures.style import new_figure, write_picture
from rfgs_core.radio import Radio
from rfgs_core.radio.delay import path_lengths_m
from rfgs_core.radio.levels import decibels
from rfgs_core.run import Run


@dataclass(frozen=True)
class LinkChannels:
    """csi − csi_static between two devices: all antenna pairs, subcarriers, held out or not."""

    radio: Radio
    """The radio."""
    frames: list[int]
    """Frames of the run."""
    measured: Complex64[np.ndarray, "frame link subcarrier"]
    """True channel of the dataset."""
    predicted: Complex64[np.ndarray, "frame link subcarrier"]
    """What the run's Gaussians give."""
    longest_m: float
    """Longer paths are not drawn [m]: twice the diagonal of the scene."""

    @property
    def error_db(self) -> float:
        """Energy of the difference over that of the measured channel [dB]; 0 explains nothing."""
        error = np.sum(np.abs(self.measured - self.predicted).astype(np.float64) ** 2)
        whole = np.sum(np.abs(self.measured).astype(np.float64) ** 2)
        return float(decibels(max(error, 1e-300) / max(whole, 1e-300), least=0.0))

    @property
    def explained(self) -> str:
        """How much of the measured channel the prediction explains, in words."""
        if self.error_db > 0.0:
            return (
                f"the prediction's error has {self.error_db:.1f} dB more energy than the change, "
                "more than if nothing were predicted"
            )
        return (
            f"the prediction leaves {round(self.error_db, 1) + 0.0:.1f} dB of the change's energy "
            "(0 dB: explains nothing)"
        )


def link_channels(run: Run, tx_device: int, rx_device: int) -> LinkChannels:
    """Reads a link of a run's dataset and predicts it.

    Raises:
        RfgsError: The radio does not measure this link.
    """
    sequence, name = run.sequence, run.config.radio
    layout, radio = whole_layout(sequence, name), sequence.radio_spec(name)
    pairs = layout.device_pairs
    if (tx_device, rx_device) not in pairs:
        known = ", ".join(f"{a}→{b}" for a, b in pairs)
        raise RfgsError(f"{name} measures no link {tx_device}→{rx_device}; it has {known}")
    tx, rx = np.nonzero(layout.measured & layout.links_between(tx_device, rx_device))
    static = whole_static(sequence, name)
    measured = [(whole_csi(sequence, name, frame) - static)[tx, rx] for frame in run.frames]
    predicted = [run.predict(frame)[tx, rx] for frame in run.frames]
    low, high = sequence.bounds_m
    longest_m = min(2.0 * float(np.linalg.norm(high - low)), radio.unambiguous_path_m)
    return LinkChannels(radio, run.frames, np.stack(measured), np.stack(predicted), longest_m)


def write_link_chart(path: Path, link: LinkChannels) -> None:
    """Draws a PNG: |ΔH| over subcarriers, delay profiles over frames; measured above predicted.

    Powers are means over the antenna pairs; each column shares one scale.
    """
    mhz, length_m = link.radio.freq_hz / 1e6, path_lengths_m(link.radio, PADDING)
    shown = length_m <= link.longest_m
    with new_figure(10.0, 6.0) as figure:
        axes = figure.subplots(2, 2)
        for column, (values, ends, label) in enumerate(
            (
                ([link.measured, link.predicted], (mhz[0], mhz[-1]), "frequency [MHz]"),
                (
                    [padded_profile(csi)[..., shown] for csi in (link.measured, link.predicted)],
                    (0.0, float(length_m[shown][-1])),
                    "path length [m]",
                ),
            )
        ):
            levels = [decibels(np.mean(np.abs(csi) ** 2, axis=1)).T for csi in values]
            top = float(levels[0].max())
            for axis, level, who in zip(
                axes[:, column], levels, ("measured", "predicted"), strict=True
            ):
                image = axis.imshow(
                    level,
                    aspect="auto",
                    origin="lower",
                    cmap="magma",
                    vmin=top - RANGE_DB,
                    vmax=top,
                    extent=(-0.5, len(link.frames) - 0.5, *ends),
                    interpolation="nearest",
                )
                step = max(1, len(link.frames) // 6)
                axis.set_xticks(range(0, len(link.frames), step), link.frames[::step])
                axis.set(title=f"{who}, H − H static [dB]", xlabel="frame", ylabel=label)
                figure.colorbar(image, ax=axis, shrink=0.8).outline.set_visible(False)  # type: ignore[operator]
        write_picture(figure, path)
