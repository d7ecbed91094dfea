# SPDX-License-Identifier: Apache-2.0
"""Plots of the card: closed forms as lines, what came out as dots."""

from __future__ import annotations

from dataset_factory.verify.card import Plot
from rfgs_core.report.charts import figure_uri, new_figure

#: One colour per pair of a closed form and its dots; readable on light and dark pages.
_COLOURS = ("#e4572e", "#3f88c5", "#2f9d6a", "#a266c9", "#c79a2b", "#8d99a6")


def plot_uri(plot: Plot) -> str:
    """A plot as an embedded PNG."""
    lines = [curve for curve in plot.curves if curve.kind == "closed form"]
    dots = [curve for curve in plot.curves if curve.kind == "measured"]
    with new_figure(6.2, 3.4) as figure:
        axes = figure.subplots()
        for index, curve in enumerate(lines):
            colour = _COLOURS[index % len(_COLOURS)]
            axes.plot(curve.x, curve.y, color=colour, linewidth=1.2, label=curve.label)
            if plot.tolerance:
                low, high = curve.y - plot.tolerance, curve.y + plot.tolerance
                axes.fill_between(curve.x, low, high, color=colour, alpha=0.18, linewidth=0.0)
        for index, curve in enumerate(dots):
            colour = _COLOURS[index % len(_COLOURS)]
            axes.plot(curve.x, curve.y, "o", color=colour, markersize=3.2, label=curve.label)
        axes.set_xlabel(plot.x_label)
        axes.set_ylabel(plot.y_label)
        axes.grid(visible=True, linewidth=0.4, alpha=0.35)
        axes.legend(fontsize=7.5, ncols=1 + (len(plot.curves) > 4))
        return figure_uri(figure)
