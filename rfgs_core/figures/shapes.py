# SPDX-License-Identifier: Apache-2.0
"""The true surface, the Gaussians and the matched filter from three sides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from rfgs_core.evaluate.baselines.matched_filter import default_score
from rfgs_core.evaluate.geometry import best_voxels
from rfgs_core.evaluate.scene import Scene
from rfgs_core.figures.style import BASELINE, TRUTH, figure_uri, new_figure, power_colours
from rfgs_core.render.view import moving_gaussians

#: Title, horizontal and vertical axis of each side.
SIDES = (("front", 0, 2), ("side", 1, 2), ("top", 0, 1))
#: Margin around the true person and everything that is predicted [m].
MARGIN_M = 0.25
#: Gaussians weaker than the strongest by more are left out [dB].
RANGE_DB = 20.0
#: Colours are spread between these percentiles of their powers. Where those differ by less [dB],
#: as on a body whose points share one reflectivity, colours say how far off each Gaussian is.
PERCENTILES, LEAST_SPAN_DB = (5.0, 95.0), 1.0
#: Last colour of distances [cm].
FARTHEST_CM = 20.0
#: At most so many points of the true surface are drawn.
DRAWN = 5000


class Colouring(NamedTuple):
    """What the colours of Gaussians say in a chart."""

    label: str
    """Name and unit."""
    values: Float[np.ndarray, "M"]
    low: float
    """Value of the first colour."""
    high: float
    """Value of the last."""


def shape_chart(scene: Scene, frame: int) -> tuple[str, str]:
    """Three rows (truth, Gaussians, matched filter) by three sides, and what the colours say."""
    surface = scene.reference(frame)
    reference = surface[:DRAWN]
    score = scene.score(frame)
    own = scene.grid.centres(best_voxels(score, scene.voxels))
    evidence = scene.evidence(frame, score)
    filtered = scene.grid.centres(best_voxels(default_score(evidence), scene.voxels))
    means, power_db = _strong_gaussians(scene, frame)
    low, high = _frame_bounds(scene, [reference, own, filtered])
    colours = colouring(means, power_db, surface)
    titles = ("true mesh", "RF-GS Gaussians", "matched filter")
    with new_figure(10.5, 10.0) as figure:
        axes = figure.subplots(3, 3)
        for column, (side, across, up) in enumerate(SIDES):
            for axis, title in zip(axes[:, column], titles, strict=True):
                faint = 0.35 if title == "true mesh" else 0.12
                axis.scatter(*reference[:, [across, up]].T, s=1.2, c=TRUTH, alpha=faint, lw=0)
                axis.set(
                    title=f"{title}, {side}",
                    xlim=(low[across], high[across]),
                    ylim=(low[up], high[up]),
                    aspect="equal",
                    xlabel="xyz"[across] + " [m]",
                    ylabel="xyz"[up] + " [m]",
                )
            style = {"cmap": power_colours(), "vmin": colours.low, "vmax": colours.high}
            shown = means[:, [across, up]].T
            points = axes[1, column].scatter(
                *shown, s=5, c=colours.values, lw=0, alpha=0.8, **style
            )
            shown = filtered[:, [across, up]].T
            axes[2, column].scatter(*shown, s=5, c=BASELINE, alpha=0.35, lw=0)
        bar = figure.colorbar(points, ax=axes, shrink=0.3, pad=0.01)
        bar.set_label(colours.label)
        bar.outline.set_visible(False)  # type: ignore[operator]
        return figure_uri(figure), colours.label.partition(" [")[0]


def colouring(
    means: Float[np.ndarray, "M 3"],
    power_db: Float[np.ndarray, "M"],
    surface: Float[np.ndarray, "n 3"],
) -> Colouring:
    """Powers where they differ, else distances to the true surface.

    Args:
        means: Centres of the Gaussians [m].
        power_db: Their power below the strongest [dB].
        surface: Points of the true surface [m].
    """
    low, high = np.percentile(power_db, PERCENTILES) if len(power_db) else (-RANGE_DB, 0.0)
    if high - low >= LEAST_SPAN_DB:
        label = "reflected power, strongest Gaussian 0 [dB]"
        return Colouring(label, power_db, float(low), float(high))
    distance_cm = 100.0 * KDTree(surface).query(means)[0]
    return Colouring("distance to the true surface [cm]", distance_cm, 0.0, FARTHEST_CM)


def _strong_gaussians(
    scene: Scene, frame: int
) -> tuple[Float[np.ndarray, "M 3"], Float[np.ndarray, "M"]]:
    """Centres and power below the strongest [dB] of the Gaussians worth drawing, weak first."""
    gaussians = moving_gaussians(scene.run, frame)
    power_db = np.asarray(scene.run.attributes(frame)["rf_power_db"], dtype=np.float64)
    power_db = power_db[len(power_db) - len(gaussians) :]
    means = gaussians.means.numpy()
    if len(means) == 0:
        return means, power_db
    power_db = power_db - power_db.max()
    order = np.argsort(power_db)
    order = order[power_db[order] > -RANGE_DB]
    return means[order], power_db[order]


def _frame_bounds(
    scene: Scene, clouds: list[Float[np.ndarray, "n 3"]]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Common limits of all panels: what is shown, within the scene."""
    points = np.concatenate(clouds)
    low, high = scene.run.sequence.bounds_m
    return (
        np.maximum(points.min(axis=0) - MARGIN_M, low),
        np.minimum(points.max(axis=0) + MARGIN_M, high),
    )
