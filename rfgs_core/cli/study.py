# SPDX-License-Identifier: Apache-2.0
"""`rfgs study`: scenes x conditions x radios x seeds in one table."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from rfgs_core.study.cases import CONDITIONS, RADIOS, SCENES


@dataclass(frozen=True)
class StudyArgs:
    """Trains and evaluates every scene, condition, radio and seed, and writes OUT/study.md.

    Scenes: living_room_walk, two_crossing, through_wall, office_sit_stand; four frames of each.
    Conditions: clean (direct paths only), impaired (noise, 10 bits, phase noise), bounces (off
    walls; not for uwb). What is finished is kept: the same command continues where it stopped,
    and with more seeds or scenes it adds them. Says before it begins what is left and how
    long that takes. A case that fails is named below the table, and the others go on: behind
    concrete nobody is heard at 60 GHz.
    """

    out: tyro.conf.Positional[Path]
    """Folder of the study: datasets, runs, study.json and study.md."""
    scenes: tuple[str, ...] = field(default_factory=lambda: tuple(SCENES))
    """Which scenes."""
    conditions: tuple[str, ...] = field(default_factory=lambda: tuple(CONDITIONS))
    """Which conditions."""
    radios: tuple[str, ...] = RADIOS
    """Which radios."""
    seeds: int = 3
    """Trainings of each case, with root seeds 0, 1, ..."""


def run(args: StudyArgs) -> int:
    """Works through the cases; exit code 0 when the table holds all of them, else 1."""
    from dataclasses import asdict

    from tqdm import tqdm

    from rfgs_core.cli.calls import call
    from rfgs_core.errors import RfgsError
    from rfgs_core.files import write_json, write_text
    from rfgs_core.report.metrics_file import read_metrics
    from rfgs_core.study.cases import cases
    from rfgs_core.study.price import price_line, timed_work
    from rfgs_core.study.summary import summarise
    from rfgs_core.study.table import study_table

    chosen = cases(args.scenes, args.conditions, args.radios, args.seeds)
    if args.out.exists() and not args.out.is_dir():
        raise RfgsError(f"{args.out} is a file; expected a folder, choose another")
    sys.stderr.write(f"{price_line(chosen, args.out)}\n")
    results, failed = [], {}
    with tqdm(chosen, desc="study", unit="case") as bar:
        for case in bar:
            bar.set_postfix_str(case.run.name)
            dataset, metrics = args.out / case.dataset, args.out / case.run / "metrics.json"
            try:
                if not metrics.exists():
                    if not (dataset / "dataset.json").exists():
                        with timed_work("generate", case, args.out):
                            call(*case.generate(args.out))
                    with timed_work("train", case, args.out):
                        call(*case.train(args.out))
                    with timed_work("evaluate", case, args.out):
                        call(*case.evaluate(args.out))
                results.append((case, read_metrics(args.out / case.run)))
            except RfgsError as error:
                failed[case.run.name] = str(error)
            rows = summarise(results)
            write_json(args.out / "study.json", [asdict(row) for row in rows])
            write_text(args.out / "study.md", study_table(rows, failed))
    sys.stdout.write(study_table(summarise(results), failed))
    sys.stdout.write(f"\n{args.out / 'study.md'} written\n")
    return 1 if failed else 0
