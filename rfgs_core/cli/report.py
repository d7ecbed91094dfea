# SPDX-License-Identifier: Apache-2.0
"""`rfgs report`: one page about a run."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class ReportArgs:
    """Writes RUN/report.html, one self-contained page about an evaluated run."""

    run: tyro.conf.Positional[Path]
    """Folder of an evaluated run."""


def run(args: ReportArgs) -> int:
    """Writes the page and prints where; exit code 0."""
    from rfgs_core.report import write_run_report
    from rfgs_core.run import open_run

    sys.stdout.write(f"{write_run_report(open_run(args.run))} written\n")
    return 0
