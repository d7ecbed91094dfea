# SPDX-License-Identifier: Apache-2.0
"""Rows of the sensitivity bench: ours, its prior alone, and the best that knows of no bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rfgs_core.evaluate.residual import GAUSSIANS_ALONE
from rfgs_core.study.cell_rows import label
from rfgs_core.study.sensitivity import Setup, Sweep
from rfgs_core.study.table import number

#: What each sweep changes, in words.
TITLES = {
    "bandwidth": "bandwidth",
    "elements": "elements of each device",
    "devices": "devices",
    "depth": "depth of tracing: bounces of paths that meet the person",
    "noise": "thermal noise, by transmit power",
    "people": "people, in rooms of their own",
    "walls": "material of the room",
}
#: Ours, and baselines that know of bodies.
OF_BODIES = ("rfgs", GAUSSIANS_ALONE, "body_prior", "template", "template_filled")


@dataclass(frozen=True)
class SweepRow:
    """One setting of a sweep; None where it was not made or has no such figure."""

    sweep: str
    setting: str
    snr_db: float | None
    """Power of what people change over that of the noise [dB]."""
    f05: float | None
    f10: float | None
    f20: float | None
    centroid_m: float | None
    element_snr_db: float | None
    """Ours, on hidden elements [dB]."""
    prior_f10: float | None
    """F10 of the body prior alone, at our places."""
    best_f10: float | None
    """F10 of the best baseline that knows of no bodies."""
    best: str
    """Who that is; empty where nobody has one."""


def sweep_rows(
    chosen: Mapping[str, Sweep], results: Mapping[Setup, Mapping[str, Any]]
) -> list[SweepRow]:
    """Rows of all sweeps in their order.

    Args:
        chosen: Sweeps by name.
        results: What files of finished setups say.
    """
    return [
        _row(sweep, setting, results.get(setup, {}))
        for sweep, points in chosen.items()
        for setting, setup in points
    ]


def _row(sweep: str, setting: str, found: Mapping[str, Any]) -> SweepRow:
    methods = found.get("methods", {})
    f10 = {name: groups["geometry"].get("f10") for name, groups in methods.items()}
    blind = {
        name: value for name, value in f10.items() if value is not None and name not in OF_BODIES
    }
    best = max(blind, key=lambda name: blind[name], default="")
    ours = methods.get("rfgs", {"geometry": {}, "rf": {}})
    return SweepRow(
        sweep=sweep,
        setting=setting,
        snr_db=found.get("snr_db"),
        **{key: ours["geometry"].get(key) for key in ("f05", "f10", "f20", "centroid_m")},
        element_snr_db=ours["rf"].get("element_snr_db"),
        prior_f10=f10.get("body_prior"),
        best_f10=blind.get(best),
        best=best,
    )


_HEAD = (
    *("F5", "F10", "F20", "centroid [m]", "elements [dB]"),
    *("prior alone F10", "best that knows of no bodies, F10"),
)


def sweep_table(rows: Sequence[SweepRow]) -> str:
    """A Markdown table per sweep."""
    lines: list[str] = []
    for sweep in dict.fromkeys(row.sweep for row in rows):
        here = [row for row in rows if row.sweep == sweep]
        snr = ("SNR [dB]",) if any(row.snr_db is not None for row in here) else ()
        head = (TITLES[sweep], *snr, *_HEAD)
        lines += [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
        lines += [f"| {' | '.join(_cells(row, bool(snr)))} |" for row in here]
        lines.append("")
    return "\n".join([*lines, _NOTES, ""])


def _cells(row: SweepRow, snr: bool) -> list[str]:
    best = f"{number(row.best_f10, '.2f')} ({label(row.best)})" if row.best else "–"
    return [
        row.setting,
        *([number(row.snr_db, ".0f")] if snr else []),
        *(number(value, ".2f") for value in (row.f05, row.f10, row.f20, row.centroid_m)),
        number(row.element_snr_db, ".1f"),
        number(row.prior_f10, ".2f"),
        best,
    ]


_NOTES = """\
One thing is changed at a time; the row of the preset as it is stands in every table. SNR: power of
what people change in the channel over that of the noise. Elements: signal over error of
csi − csi_static on hidden elements. Prior alone: what the fit assumes of bodies, at the places it
finds."""
