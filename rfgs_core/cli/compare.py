# SPDX-License-Identifier: Apache-2.0
"""`rfgs compare`: two runs beside each other."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class CompareArgs:
    """Compares the metrics of two evaluated runs."""

    first: tyro.conf.Positional[Path]
    """Folder of an evaluated run."""
    second: tyro.conf.Positional[Path]
    """Folder of another one."""
    out: Path | None = None
    """Also write the table to this file: .md for Markdown, .html for a page."""


def run(args: CompareArgs) -> int:
    """Prints the table; exit code 0."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.files import write_text
    from rfgs_core.report.compare import (
        comparison_rows,
        differences,
        markdown_comparison,
        text_comparison,
    )
    from rfgs_core.report.metrics_file import read_metrics
    from rfgs_core.report.page import comparison_page
    from rfgs_core.run.config import RunConfig

    if args.out is not None and args.out.suffix not in (".md", ".html"):
        raise RfgsError(f"{args.out}: expected a name that ends in .md or .html")
    first, second = read_metrics(args.first), read_metrics(args.second)
    datasets = (
        RunConfig.read(args.first).dataset_fingerprint,
        RunConfig.read(args.second).dataset_fingerprint,
    )
    names = (args.first.resolve().name, args.second.resolve().name)
    if names[0] == names[1]:
        names = (str(args.first), str(args.second))
    rows = comparison_rows(first, second, names)
    notes = [f"Not the same conditions: {line}" for line in differences(first, second, datasets)]
    sys.stdout.write(text_comparison(rows, notes))
    if args.out is not None:
        page = comparison_page if args.out.suffix == ".html" else markdown_comparison
        write_text(args.out, page(rows, notes))
        sys.stdout.write(f"{args.out} written\n")
    return 0
