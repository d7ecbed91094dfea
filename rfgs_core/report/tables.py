# SPDX-License-Identifier: Apache-2.0
"""Tables of metrics: the method beside its baselines, and two runs beside each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.residual import GAUSSIANS_ALONE

METHOD_LABEL = "RF-GS"


@dataclass(frozen=True)
class Column:
    """One metric of a table."""

    key: str
    """Key within its group of `metrics.json`."""
    label: str
    """Heading."""
    unit: str
    """Unit, empty for a ratio."""
    higher_is_better: bool
    """Direction in which the metric improves."""
    digits: int
    """Decimal places shown."""
    explanation: str
    """One sentence for readers who do not know it."""


_CHANNEL_COLUMNS = (
    Column("element_snr_db", "elements", "dB", True, 1, "SNR on unseen array columns"),
    Column("subcarrier_snr_db", "subcarriers", "dB", True, 1, "SNR on unseen subcarriers"),
    Column("device_gain_mae_db", "pair gain", "dB", False, 1, "error on unseen pairs"),
    Column("delay_profile_corr", "delay profile", "", True, 2, "correlation, unseen links"),
)

_BACKGROUND_COLUMNS = (
    Column("visible_snr_db", "visible", "dB", True, 1, "SNR on what training sees"),
    *_CHANNEL_COLUMNS,
    Column("pair_snr_db", "pair", "dB", True, 1, "SNR on unseen device pairs, with phase"),
)

#: Group of `metrics.json` → title and columns.
GROUPS: dict[str, tuple[str, tuple[Column, ...]]] = {
    "geometry": (
        "Geometry of what moves",
        (
            Column("f05", "F5", "", True, 3, "F-score at 5 cm, K voxels, mean over frames"),
            Column("f10", "F10", "", True, 3, "F-score at 10 cm, K voxels, mean over frames"),
            Column("f20", "F20", "", True, 3, "F-score at 20 cm, K voxels, mean over frames"),
            Column("f10_best", "F10 best K", "", True, 3, "best F10 over the number of voxels"),
            Column("chamfer_m", "Chamfer", "m", False, 3, "mean of both mean nearest distances"),
            Column("centroid_m", "centroid", "m", False, 3, "distance between the centroids"),
            Column("height_m", "height", "m", False, 3, "error of the vertical extent"),
            Column("tracked", "tracked", "", True, 2, "share of frames with centroid in 0.5 m"),
        ),
    ),
    "rf": (
        "Held-out channel, csi − csi_static",
        _CHANNEL_COLUMNS,
    ),
    "rf_csi": (
        "Held-out channel, whole csi (secondary; who brings no empty room gets the kriged one)",
        _CHANNEL_COLUMNS,
    ),
    "image": (
        "Pictures the shader never saw (display)",
        (
            Column("psnr", "PSNR", "dB", True, 1, "whole picture"),
            Column("psnr_person", "PSNR person", "dB", True, 1, "true ∪ predicted mask on grey"),
            Column("ssim", "SSIM", "", True, 3, "structural similarity"),
            Column("lpips", "LPIPS", "", False, 3, "learned distance"),
        ),
    ),
}


@dataclass(frozen=True)
class Cell:
    """One value of a table."""

    text: str
    """Value as shown, a dash where there is none."""
    best: bool = False
    """Whether no competitor is better."""
    why: str = ""
    """Why there is no value."""


@dataclass(frozen=True)
class Row:
    """One method or baseline."""

    label: str
    """Name."""
    kind: str
    """`method`, `baseline` or `ceiling`."""
    cells: list[Cell]
    """One per column."""


@dataclass(frozen=True)
class Table:
    """A group of metrics, method first."""

    title: str
    """Heading."""
    columns: tuple[Column, ...]
    """Metrics."""
    rows: list[Row]
    """Method, baselines, ceiling."""
    losses: list[str]
    """In words: where a baseline does at least as well as the method."""


def metric_tables(metrics: Mapping[str, Any]) -> list[Table]:
    """All tables of a run; baselines without any value of a group are left out of it."""
    tables = [_table(metrics, group) for group in GROUPS if metrics.get(group)]
    return [*tables, *([_background_table(metrics)] if metrics.get("background") else [])]


def _background_table(metrics: Mapping[str, Any]) -> Table:
    """The empty room as the static set predicts it, beside what needs no Gaussians."""
    part = metrics["background"]
    best = {column.key: _best(part["rows"], column) for column in _BACKGROUND_COLUMNS}
    rows = []
    for name, values in part["rows"].items():
        cells = []
        for column in _BACKGROUND_COLUMNS:
            value = _rounded(values, column)
            wins = value is not None and value == best[column.key]
            cells.append(Cell(show(values[column.key], column.digits), wins, "not computed"))
        rows.append(Row(name, "method" if name.startswith("static") else "baseline", cells))
    title = f"The empty room, csi_static, from {part['n_gaussians']} static Gaussians"
    if part["surface_m"]:
        near = {name: f"{100 * value:.0f} cm" for name, value in part["surface_m"].items()}
        title += (
            f" (half of their power within {near['power_median']} of a true surface; anywhere in "
            f"the room: {near['chance_median']})"
        )
    return Table(title, _BACKGROUND_COLUMNS, rows, [])


def _table(metrics: Mapping[str, Any], group: str) -> Table:
    title, columns = GROUPS[group]
    values = {METHOD_LABEL: metrics[group]}
    for name in sorted(metrics["baselines"], key=_place):
        part = metrics["baselines"][name].get(group) or {}
        # The ceiling stays visible, with the reason, even if it has no value.
        if any(part.get(column.key) is not None for column in columns) or _is_wanted(name, group):
            values[name] = part
    best = {column.key: _best(values, column) for column in columns}
    rows = []
    for name, part in values.items():
        cells = []
        for column in columns:
            value = _rounded(part, column)
            wins = value is not None and value == best[column.key] and name != "oracle_init"
            why = _reason(metrics, name, group, column.key)
            cells.append(Cell(show(part.get(column.key), column.digits), wins, why))
        rows.append(Row(name, _kind(name), cells))
    return Table(title, columns, rows, _losses(values, columns))


def _place(name: str) -> tuple[int, str]:
    """Order of baselines: as they are listed in the code, the ceiling last."""
    order = [GAUSSIANS_ALONE, *BASELINES, "silhouette", "oracle_init"]
    return (order.index(name) if name in order else len(order), name)


def _rounded(part: Mapping[str, Any], column: Column) -> float | None:
    """A value as shown: what looks equal counts as equal."""
    value = part.get(column.key)
    return None if value is None else round(float(value), column.digits)


def _is_wanted(name: str, group: str) -> bool:
    return name == "oracle_init" and group == "geometry"


def _kind(name: str) -> str:
    return {METHOD_LABEL: "method", "oracle_init": "ceiling"}.get(name, "baseline")


def _best(values: Mapping[str, Mapping[str, Any]], column: Column) -> float | None:
    parts = [_rounded(part, column) for name, part in values.items() if name != "oracle_init"]
    known = [value for value in parts if value is not None]
    if not known:
        return None
    return max(known) if column.higher_is_better else min(known)


def _losses(values: Mapping[str, Mapping[str, Any]], columns: tuple[Column, ...]) -> list[str]:
    """Sentences on every metric in which a baseline does better."""
    sentences = []
    for column in columns:
        mine = _rounded(values[METHOD_LABEL], column)
        if mine is None:
            continue
        better = []
        for name, part in values.items():
            value = _rounded(part, column)
            if _kind(name) == "baseline" and value is not None and value != mine:
                if (value > mine) == column.higher_is_better:
                    better.append(f"{name} ({show(value, column.digits)})")
        if better:
            unit = f" {column.unit}" if column.unit else ""
            sentences.append(
                f"{column.label}: {METHOD_LABEL} ({show(mine, column.digits)}{unit}) loses to "
                f"{', '.join(better)}."
            )
    return sentences


def _reason(metrics: Mapping[str, Any], name: str, group: str, key: str) -> str:
    """The stored reason nearest to a missing value."""
    reasons = metrics.get("reasons", {})
    start = "" if name == METHOD_LABEL else f"baselines.{name}."
    paths = [f"{start}{group}.{key}", f"{start}{group}", start.rstrip("."), f"{group}.{key}", group]
    if group == "image":
        paths.append("baselines.*.image")
    return next((reasons[path] for path in paths if path in reasons), "not computed")


def show(value: float | None, digits: int) -> str:
    """A number with fixed decimals and a true minus sign; a dash for None."""
    return "–" if value is None else f"{value:.{digits}f}".replace("-", "−")


def text_table(metrics: Mapping[str, Any]) -> str:
    """All tables for a terminal; the best value of a column carries a star."""
    blocks = []
    for table in metric_tables(metrics):
        heads = ["", *(f"{c.label} [{c.unit}]" if c.unit else c.label for c in table.columns)]
        body = [[row.label, *(_starred(cell) for cell in row.cells)] for row in table.rows]
        blocks.append(f"{table.title}  (* best)\n{align([heads, *body])}")
    return "\n".join(blocks) + "\n"


def _starred(cell: Cell) -> str:
    return f"{cell.text}{'*' if cell.best else ' '}"


def align(rows: list[list[str]]) -> str:
    """Rows of text in columns: the first to the left, the others to the right."""
    width = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            row[0].ljust(width[0]),
            *(c.rjust(w) for c, w in zip(row[1:], width[1:], strict=True)),
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines) + "\n"
