# SPDX-License-Identifier: Apache-2.0
"""Plots of the card: closed forms as lines, what came out as dots."""

from __future__ import annotations

from dataset_factory.verify.card import Plot
from rfgs_core.figures.style import figure_uri, new_figure

#: Colours of what came out, in order; readable on light and dark pages.
_DOTS = ("#e4572e", "#2f9d6a", "#a266c9", "#c79a2b", "#3f88c5", "#8d99a6")
#: Colour of a lone closed form; several have the colours of their dots.
_LINE = "#3f88c5"


def plot_uri(plot: Plot) -> str:
    """A plot as an embedded PNG."""
    lines = [curve for curve in plot.curves if curve.kind == "closed form"]
    dots = [curve for curve in plot.curves if curve.kind == "measured"]
    colours = _DOTS if len(lines) > 1 else (_LINE,)
    with new_figure(6.2, 3.4) as figure:
        axes = figure.subplots()
        for index, curve in enumerate(lines):
            colour, name = colours[index % len(colours)], curve.label or "_nolegend_"
            axes.plot(curve.x, curve.y, color=colour, linewidth=1.3, label=name)
            if plot.tolerance:
                low, high = curve.y - plot.tolerance, curve.y + plot.tolerance
                axes.fill_between(curve.x, low, high, color=colour, alpha=0.22, linewidth=0.0)
        for index, curve in enumerate(dots):
            colour, name = _DOTS[index % len(_DOTS)], curve.label or "_nolegend_"
            axes.plot(curve.x, curve.y, "o", color=colour, markersize=3.0, label=name)
        axes.set_xlabel(plot.x_label)
        axes.set_ylabel(plot.y_label)
        if plot.log_x:
            axes.set_xscale("log")
            for axis_format in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
                axis_format(lambda value, _: f"{value:g}")
        axes.grid(visible=True, linewidth=0.4, alpha=0.35)
        axes.legend(fontsize=7.5)
        return figure_uri(figure)
