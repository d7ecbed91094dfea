# SPDX-License-Identifier: Apache-2.0
"""Two runs beside each other, and whether they may be compared at all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rfgs_core.frames import listed
from rfgs_core.report.tables import GROUPS, align, show

#: Conditions that must agree for a comparison to mean anything.
CONDITIONS = (
    "scene",
    "sequence",
    "radio",
    "num_frames",
    "voxels_predicted",
    "impairments",
    *("observe", "packets", "background"),
)


def differences(
    first: Mapping[str, Any], second: Mapping[str, Any], datasets: tuple[str, str]
) -> list[str]:
    """Sentences on conditions in which two runs differ.

    Args:
        first: Metrics of a run.
        second: Metrics of another one.
        datasets: Fingerprints of the datasets that they were trained on.
    """
    pairs = [
        (name, first["conditions"].get(name), second["conditions"].get(name)) for name in CONDITIONS
    ]
    pairs.append(("trace_depth", first.get("trace_depth"), second.get("trace_depth")))
    pairs.append(("frames", _frames(first), _frames(second)))
    pairs.append(("dataset, by its fingerprint", datasets[0][:12], datasets[1][:12]))
    return [f"{name}: {a} against {b}" for name, a, b in pairs if a != b]


def _frames(metrics: Mapping[str, Any]) -> str:
    """Frames that were evaluated."""
    return listed([row["frame"] for row in metrics["frames"]])


def comparison_rows(
    first: Mapping[str, Any], second: Mapping[str, Any], names: tuple[str, str]
) -> list[list[str]]:
    """Heading and one row per metric that both runs could compute."""
    rows = [["metric", names[0], names[1], "difference", "better"]]
    for group, (_, columns) in GROUPS.items():
        for column in columns:
            a = (first.get(group) or {}).get(column.key)
            b = (second.get(group) or {}).get(column.key)
            if a is None and b is None:
                continue
            label = f"{group}.{column.key}"
            change, better = "–", "–"
            if a is not None and b is not None:
                change = show(b - a, column.digits)
                ahead = (b > a) == column.higher_is_better
                better = "equal" if a == b else names[int(ahead)]
            rows.append([label, show(a, column.digits), show(b, column.digits), change, better])
    for key, digits in (("n_gaussians", 0), ("train_s", 1)):
        a, b = first.get(key), second.get(key)
        change = show(b - a, digits) if a is not None and b is not None else "–"
        rows.append([key, show(a, digits), show(b, digits), change, ""])
    return rows


def text_comparison(rows: list[list[str]], notes: list[str]) -> str:
    """The comparison for a terminal."""
    return "".join([*(f"{note}\n" for note in notes), align(rows)])


def markdown_comparison(rows: list[list[str]], notes: list[str]) -> str:
    """The comparison as a Markdown file."""
    head, *body = rows
    lines = ["# Comparison of two runs", "", *(f"> {note}" for note in notes), ""]
    lines += ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    lines += ["| " + " | ".join(row) + " |" for row in body]
    return "\n".join(lines) + "\n"
