# SPDX-License-Identifier: Apache-2.0
"""`rfgs eval`: metrics of a run beside its baselines."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class EvalArgs:
    """Evaluates a run with all baselines and writes RUN/metrics.json."""

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""
    oracle: bool = True
    """Also start the fit on the true surface, as the ceiling; takes another training."""


def run(args: EvalArgs) -> int:
    """Writes the metrics and prints the verdicts; exit code 0."""
    from rfgs_core.evaluate.metrics import evaluate_run
    from rfgs_core.report.tables import text_table
    from rfgs_core.run import open_run

    trained = open_run(args.run)
    trained.need_frames()
    metrics = evaluate_run(trained, oracle=args.oracle)
    sys.stdout.write(text_table(metrics))
    for sentence in metrics["verdicts"]:
        sys.stdout.write(f"{sentence}\n")
    sys.stdout.write(f"{args.run / 'metrics.json'} written in {metrics['eval_s']:.0f} s\n")
    return 0
