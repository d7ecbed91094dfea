# SPDX-License-Identifier: Apache-2.0
"""The sensitivity bench as a picture: F10 against what is changed, a panel per sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rfgs_core.figures.style import BASELINE, METHOD, TRUTH, new_figure, write_picture
from rfgs_core.study.sensitivity_rows import SweepRow

#: Shorter than what tables say.
_TITLES = {"depth": "depth of tracing", "noise": "transmit power", "elements": "elements"}


def write_sweeps(path: Path, rows: Sequence[SweepRow]) -> None:
    """Writes a PNG: ours, its prior alone and the best that knows of no bodies, F10 of each."""
    names = list(dict.fromkeys(row.sweep for row in rows))
    with new_figure(2.9 * len(names), 3.3) as figure:
        panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
        for axis, name in zip(panels, names, strict=True):
            here = [row for row in rows if row.sweep == name]
            for values, colour, what in (
                ([row.f10 for row in here], METHOD, "RF-GS"),
                ([row.prior_f10 for row in here], TRUTH, "its prior alone"),
                ([row.best_f10 for row in here], BASELINE, "best without a body"),
            ):
                places = [x for x, value in enumerate(values) if value is not None]
                known = [value for value in values if value is not None]
                axis.plot(places, known, "o-", color=colour, label=what, markersize=4)
            settings = [row.setting for row in here]
            axis.set_xticks(
                range(len(here)), settings, rotation=30, ha="right", rotation_mode="anchor"
            )
            axis.set(title=_TITLES.get(name, name), ylim=(0.0, 1.0), xlim=(-0.3, len(here) - 0.7))
            axis.grid(axis="y", alpha=0.25)
        panels[0].set_ylabel("F10")
        panels[-1].legend(loc="lower left", fontsize=8)
        write_picture(figure, path)
