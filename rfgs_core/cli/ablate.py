# SPDX-License-Identifier: Apache-2.0
"""`rfgs ablate`: the paper's table 2, measured."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class AblateArgs:
    """Trains the paper's recipe whole and less one part at a time, and writes OUT/ablation.md.

    What is finished is kept: the same command continues where it stopped.
    """

    dataset: tyro.conf.Positional[Path]
    """Dataset folder, as `rfgs-factory generate` makes it."""
    radio: str
    """Which of the dataset's radios, for example wifi."""
    out: Path
    """Folder of the runs and of ablation.md."""
    frames: str | None = None
    """Frames A:B[:STEP] (inclusive), or one number; all when left out."""
    iterations: int = 10_000
    """Adam steps per frame (the paper: 10,000)."""
    seed: int = 0
    """Root seed."""


def run(args: AblateArgs) -> int:
    """Works through the variants; exit code 0 when the table holds all of them."""
    from tqdm import tqdm

    from rfgs_core.cli.calls import call
    from rfgs_core.dataset import open_dataset
    from rfgs_core.errors import RfgsError
    from rfgs_core.files import write_text
    from rfgs_core.frames import chosen_frames
    from rfgs_core.report.metrics_file import read_metrics
    from rfgs_core.run import open_run
    from rfgs_core.study.ablation import VARIANTS, ablation_row, ablation_table

    if args.out.exists() and not args.out.is_dir():
        raise RfgsError(f"{args.out} is a file; expected a folder, choose another")
    if args.iterations < 0:
        raise RfgsError(f"--iterations {args.iterations}: expected at least 0")
    sequence = open_dataset(args.dataset).sequence()
    sequence.radio_spec(args.radio)
    chosen_frames(args.frames, sequence.frames)
    rows = []
    with tqdm(VARIANTS, desc="ablation", unit="variant") as bar:
        for variant in bar:
            bar.set_postfix_str(variant.name)
            folder = args.out / variant.name
            if not (folder / "metrics.json").exists():
                frames = ("--frames", args.frames) if args.frames else ()
                call(
                    *("rfgs_core.cli", "train", str(args.dataset), "--radio", args.radio),
                    *("--recipe", "paper", "--objective", "paper", *frames),
                    *("--iterations", str(args.iterations), "--seed", str(args.seed)),
                    *("--no-shader", *variant.options, "--out", str(folder)),
                )
                call("rfgs_core.cli", "eval", str(folder))
            done = open_run(folder)
            count = len(done.moving(done.frames[0]))
            metrics = {**read_metrics(folder), "train_s": done.config.train_s}
            rows.append(ablation_row(variant, metrics, count))
            write_text(args.out / "ablation.md", ablation_table(rows))
    sys.stdout.write(f"{ablation_table(rows)}\n{args.out / 'ablation.md'} written\n")
    return 0
