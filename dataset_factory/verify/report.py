# SPDX-License-Identifier: Apache-2.0
"""The card as text for a terminal, as Markdown, as one HTML page and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import jinja2

from dataset_factory.plan.contents import versions
from dataset_factory.verify.card import Card, Group, Plot, Row, number
from rfgs_core.evaluate.provenance import hardware
from rfgs_core.figures.style import figure_uri, new_figure
from rfgs_core.files import write_json, write_text
from rfgs_core.report.page import duration

LEAD = (
    "Small scenes with closed forms, each built in Blender, exported by the add-on and traced like "
    "any other. Tolerances were set before the results were seen."
)
_HEAD = ("", "closed form", "came out", "error", "tolerance", "")


def facts(command: str, card: Card) -> list[tuple[str, str]]:
    """What stands beside the numbers: machine, date, versions and command line."""
    machine = hardware()
    seconds = sum(group.seconds for group in card.groups)
    packages = ", ".join(f"{name} {version}" for name, version in versions().items())
    return [
        ("Command", command),
        ("Date", datetime.now(UTC).strftime("%Y-%m-%d")),
        ("Machine", f"{machine['cpu']}, {machine['cores']} cores"),
        ("Time", duration(seconds)),
        ("Versions", packages),
    ]


def summary(card: Card) -> str:
    """How many rows hold, in one sentence; those that do not are named."""
    passed = len(card.rows) - len(card.missed)
    said = f"{passed} of {len(card.rows)} rows hold."
    return said + (f" Missed: {'; '.join(card.missed)}." if card.missed else "")


def as_text(card: Card) -> str:
    """Tables for a terminal."""
    parts = []
    for group in card.groups:
        rows = [_HEAD, *(_cells(row) for row in group.rows)]
        widths = [max(len(cells[i]) for cells in rows) for i in range(len(_HEAD))]
        lines = [
            "  ".join(text.ljust(width) for text, width in zip(cells, widths, strict=True)).rstrip()
            for cells in rows
        ]
        parts.append("\n".join([f"{group.title} ({duration(group.seconds)})", *lines]))
    return "\n\n".join([*parts, summary(card)]) + "\n"


def as_markdown(card: Card) -> str:
    """The page of the documentation; every figure in it was measured by this run."""
    lines = ["# The card of physics", "", LEAD, "", f"**{summary(card)}**", ""]
    lines += _table(("", ""), card.facts)
    lines += ["", "Written by the command above; do not edit."]
    for group in card.groups:
        lines += ["", f"## {group.title}", "", group.words, ""]
        head = ("`--only " + group.name + "`", *_HEAD[1:], "source")
        lines += _table(head, [(*_cells(row), row.source) for row in group.rows])
    return "\n".join(lines) + "\n"


def as_html(card: Card) -> str:
    """One page that loads nothing from elsewhere; plots are part of it."""
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [
                jinja2.PackageLoader("dataset_factory.verify", ""),
                jinja2.PackageLoader("rfgs_core.report", ""),
            ]
        ),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("card.html.j2").render(
        lead=LEAD,
        summary=summary(card),
        card=card,
        cells={id(row): _cells(row) for _, row in card.rows},
        id=id,
        figures={group.name: _figures(group) for group in card.groups},
    )


def write_card(card: Card, folder: Path) -> None:
    """Writes `index.html`, `physics.md` and `card.json`, each in one step."""
    write_text(folder / "index.html", as_html(card))
    write_text(folder / "physics.md", as_markdown(card))
    write_json(folder / "card.json", card.as_json())


def _cells(row: Row) -> tuple[str, ...]:
    """A row as shown: name, closed form, what came out, error, tolerance, verdict."""
    unit = f" {row.unit}".rstrip()
    error, limit = (f"{number(value)}{unit}" for value in (row.error, row.tolerance))
    return row.name, row.expected, row.got, error, limit, "holds" if row.ok else "MISSED"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(text.replace("|", "\\|") for text in line) + " |" for line in lines]


def _figures(group: Group) -> list[tuple[str, str]]:
    """Data URI and title of each plot."""
    return [(plot_uri(plot), plot.title) for plot in group.plots]


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
