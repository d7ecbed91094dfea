# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory stats`."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro


@dataclass(frozen=True)
class StatsArgs:
    """Describes a dataset in numbers: links, levels, what moves, delays, labels."""

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    sequence: str | None = None
    """Which sequence; default: all."""
    json: bool = False
    """Print JSON instead of a table."""


def run(args: StatsArgs) -> int:
    """Prints the numbers."""
    from dataset_factory.check.stats import stats

    found = stats(args.dataset, args.sequence)
    if args.json:
        sys.stdout.write(json.dumps(found, indent=1, sort_keys=True, allow_nan=False) + "\n")
        return 0
    for name, numbers in found["sequences"].items():
        sys.stdout.write(f"{name}\n")
        sys.stdout.write("".join(f"  {key:<42} {text}\n" for key, text in _rows(numbers)))
    return 0


def _rows(value: dict[str, Any], above: str = "") -> list[tuple[str, str]]:
    """Nested numbers as rows of dotted names."""
    rows = []
    for key, item in value.items():
        if key == "settings":
            chosen = (f"{name} {setting}" for name, setting in item.items() if setting)
            rows.append((f"{above}{key}", ", ".join(chosen)))
        elif isinstance(item, dict):
            rows += _rows(item, f"{above}{key}.")
        else:
            text = ", ".join(map(str, item)) if isinstance(item, list) else str(item)
            rows.append((f"{above}{key}", text))
    return rows
