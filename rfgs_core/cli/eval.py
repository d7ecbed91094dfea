# SPDX-License-Identifier: Apache-2.0
"""`rfgs eval`: metrics of a run beside its baselines."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class EvalArgs:
    """Evaluates a run with all baselines and writes RUN/metrics.json."""

    run: tyro.conf.Positional[Path | None] = None
    """Folder of a trained run."""
    example: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Evaluate the small run that comes with the package, in your cache."""
    oracle: bool = True
    """Also start the fit on the true surface, as the ceiling; takes another training."""


def run(args: EvalArgs) -> int:
    """Writes the metrics and prints the verdicts; exit code 0."""
    from rfgs_core.evaluate.metrics import evaluate_run
    from rfgs_core.example import chosen_run
    from rfgs_core.report.tables import text_table
    from rfgs_core.run import open_run

    path = chosen_run(args.run, args.example)
    trained = open_run(path)
    trained.need_frames()
    metrics = evaluate_run(trained, oracle=args.oracle)
    sys.stdout.write(text_table(metrics))
    for sentence in metrics["verdicts"]:
        sys.stdout.write(f"{sentence}\n")
    sys.stdout.write(f"{path / 'metrics.json'} written in {metrics['eval_s']:.0f} s\n")
    return 0
