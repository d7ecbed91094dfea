# SPDX-License-Identifier: Apache-2.0
"""Contact sheets of a sequence's pictures."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from rfgs_core.dataset import Sequence

#: Larger sheets would no longer be seen at a glance.
MOST_CAMERAS = 6

#: What shows through where a picture is transparent.
_BACKDROP = np.array([0.93, 0.94, 0.96])


def layer_sheet(sequence: Sequence) -> Figure:
    """Colour, depth, normals and instances of the middle frame, cameras by rows."""
    names = [row["name"] for row in sequence.cameras][:MOST_CAMERAS]
    frame = sequence.frames[len(sequence.frames) // 2]
    figure, axes = _grid(len(names), 4)
    far = float(np.linalg.norm(sequence.bounds_m[1] - sequence.bounds_m[0]))
    for row, name in zip(axes, names, strict=True):
        row[0].imshow(over_backdrop(sequence.image(name, frame)))
        shown = row[1].imshow(sequence.depth(name, frame), cmap="viridis_r", vmin=0, vmax=far)
        figure.colorbar(shown, ax=row[1], fraction=0.046, pad=0.03).ax.tick_params(labelsize=7)
        row[2].imshow(np.clip(0.5 + 0.5 * sequence.normal(name, frame), 0, 1))
        row[3].imshow(_instance_colours(sequence.mask(name, frame)))
        row[0].set_ylabel(_label(sequence, name), fontsize=9)
    for axis, title in zip(axes[0], ("colour", "depth [m]", "normal", "instance"), strict=True):
        axis.set_title(title, fontsize=9)
    return figure


def _grid(rows: int, cols: int) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=(1.9 * cols + 0.6, 1.9 * rows + 0.4), layout="constrained")
    axes = figure.subplots(rows, cols, squeeze=False)
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
        axis.spines[:].set_visible(False)
    return figure, axes


def _label(sequence: Sequence, name: str) -> str:
    row = next(row for row in sequence.cameras if row["name"] == name)
    return f"{name} (test)" if row["split"] == "test" else name


def over_backdrop(rgba: np.ndarray) -> np.ndarray:
    """Colours in [0, 1] on a plain backdrop where a picture is transparent."""
    alpha = rgba[..., 3:] / 255.0
    return rgba[..., :3] / 255.0 * alpha + _BACKDROP * (1.0 - alpha)


def _instance_colours(mask: np.ndarray) -> np.ndarray:
    palette = colormaps["tab10"](np.arange(10))[:, :3]
    colours = palette[(mask.astype(np.int64) - 1) % len(palette)]
    return np.where(mask[..., None] == 0, np.array([0.16, 0.18, 0.22]), colours)
