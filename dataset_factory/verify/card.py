# SPDX-License-Identifier: Apache-2.0
"""A card of physics: rows of closed forms beside what came out, and the plots that show them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np


@dataclass(frozen=True)
class Row:
    """One claim, its tolerance set before, and what came out."""

    name: str
    """What is compared, unique within its group."""
    expected: str
    """The closed form's value as shown, with its unit."""
    got: str
    """What the chain gave, as shown."""
    error: float
    """How far apart they are, in `unit`; NaN counts as a miss."""
    tolerance: float
    """The largest error that holds, in `unit`."""
    unit: str
    """Unit of error and tolerance."""
    source: str
    """Where the closed form stands."""

    @property
    def ok(self) -> bool:
        """Whether the claim holds."""
        return bool(self.error <= self.tolerance)

    def as_json(self) -> dict[str, Any]:
        """Plain values; numbers that JSON has no word for become None."""
        values = {**vars(self), "ok": self.ok}
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in values.items()
        }


def near(name: str, expected: float, got: float, tolerance: float, unit: str, source: str) -> Row:
    """A row whose error is the distance of two values in one unit."""
    exact, found = (f"{number(value)} {unit}".strip() for value in (expected, got))
    return Row(name, exact, found, abs(got - expected), tolerance, unit, source)


def within(name: str, error: float, tolerance: float, unit: str, source: str) -> Row:
    """A row that is an error itself, expected to be at most `tolerance`."""
    limit, found = f"≤ {number(tolerance)} {unit}", f"{number(error)} {unit}"
    return Row(name, limit.strip(), found.strip(), error, tolerance, unit, source)


def at_least(name: str, got: float, least: float, source: str) -> Row:
    """A row of a share of 1; its error is what is missing of 1."""
    return Row(name, f"≥ {least:g}", f"{got:.4f}", 1.0 - got, 1.0 - least, "", source)


@dataclass(frozen=True)
class Curve:
    """One line or set of dots."""

    label: str
    """For the legend; empty stays out of it."""
    x: np.ndarray
    """Shape (point,)."""
    y: np.ndarray
    """Shape (point,)."""
    kind: Literal["closed form", "measured"]
    """Lines are closed forms, dots came out of the chain."""


@dataclass(frozen=True)
class Plot:
    """One plot."""

    title: str
    """What it shows."""
    x_label: str
    """With unit."""
    y_label: str
    """With unit."""
    curves: Sequence[Curve]
    """Its curves."""
    tolerance: float = 0.0
    """Half the width of the band around closed forms, in units of y; 0 draws none."""
    log_x: bool = False
    """Whether x is drawn on a logarithmic axis."""


@dataclass(frozen=True)
class Group:
    """Rows of one subject."""

    name: str
    """Name on the command line."""
    title: str
    """Heading."""
    words: str
    """What was built, traced and compared."""
    rows: Sequence[Row]
    """Its claims."""
    plots: Sequence[Plot] = ()
    """Its plots."""
    seconds: float = 0.0
    """Wall time that it took [s]."""


@dataclass
class Card:
    """Everything that one run found."""

    groups: list[Group] = field(default_factory=list)
    """In the order in which they were asked for."""
    facts: list[tuple[str, str]] = field(default_factory=list)
    """Machine, date, versions and command line."""

    @property
    def rows(self) -> list[tuple[Group, Row]]:
        """All rows with their groups."""
        return [(group, row) for group in self.groups for row in group.rows]

    @property
    def missed(self) -> list[str]:
        """Names of the rows that do not hold, `group: row`."""
        return [f"{group.name}: {row.name}" for group, row in self.rows if not row.ok]

    def as_json(self) -> dict[str, Any]:
        """The card in plain types."""
        return {
            "facts": dict(self.facts),
            "missed": self.missed,
            "groups": [
                {
                    "name": group.name,
                    "title": group.title,
                    "words": group.words,
                    "seconds": round(group.seconds, 1),
                    "rows": [row.as_json() for row in group.rows],
                    "plots": [_plot_json(plot) for plot in group.plots],
                }
                for group in self.groups
            ],
        }


def _plot_json(plot: Plot) -> dict[str, Any]:
    curves = [
        {"label": c.label, "kind": c.kind, "x": _finite(c.x), "y": _finite(c.y)}
        for c in plot.curves
    ]
    return {**vars(plot), "curves": curves}


def _finite(values: Iterable[float]) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]


def number(value: float) -> str:
    """Four significant digits, without a trailing exponent where none is needed.

    Example:
        >>> number(-62.34567), number(0.00012345), number(0.0)
        ('-62.35', '0.0001234', '0')
    """
    if not math.isfinite(value):
        return str(value)
    if value and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.3g}"
    return f"{value:.4g}"
