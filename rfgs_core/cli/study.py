# SPDX-License-Identifier: Apache-2.0
"""`rfgs study`: scenes x conditions x radios x seeds in one table."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from rfgs_core.cli.spreading import Spreading, need_folder, watched
from rfgs_core.study.cases import CONDITIONS, RADIOS, SCENES, Case

if TYPE_CHECKING:
    from rfgs_core.schedule.spread import Spread


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
    spread: Annotated[Spreading, tyro.conf.arg(name="")] = field(default_factory=Spreading)


@dataclass(frozen=True)
class CasePart:
    """A case as a part of a study, made by the commands that anybody may give."""

    case: Case
    """Which one."""

    def __str__(self) -> str:
        return self.case.run.name

    @property
    def dataset(self) -> Path:
        """Folder of its dataset within the study's."""
        return self.case.dataset

    @property
    def made(self) -> tuple[Path, ...]:
        """Its run, with the metrics in it."""
        return (self.case.run,)

    def make(self, out: Path) -> None:
        """Trains and evaluates it."""
        from rfgs_core.cli.calls import call
        from rfgs_core.study.price import timed_work

        with timed_work("train", self.case, out):
            call(*self.case.train(out))
        with timed_work("evaluate", self.case, out):
            call(*self.case.evaluate(out))


def run(args: StudyArgs) -> int:
    """Works through the cases; exit code 0 when the table holds all of them, else 1."""
    from dataclasses import asdict

    from rfgs_core.files import write_json, write_text
    from rfgs_core.report.metrics_file import read_metrics
    from rfgs_core.study.cases import cases
    from rfgs_core.study.price import price_line
    from rfgs_core.study.summary import summarise
    from rfgs_core.study.table import study_table

    chosen = cases(args.scenes, args.conditions, args.radios, args.seeds)
    need_folder(args.out)
    spread = args.spread.checked()
    sys.stderr.write(f"{price_line(chosen, args.out)}\n")
    results: dict[Case, Any] = {}
    failed: dict[str, str] = {}
    rows = []
    walk = partial(_outcomes, chosen, args.out, spread)
    for case, failure in watched(walk, len(chosen), "study", "case"):
        if failure:
            failed[case.run.name] = failure
        else:
            results[case] = read_metrics(args.out / case.run)
        rows = summarise([(one, results[one]) for one in chosen if one in results])
        write_json(args.out / "study.json", [asdict(row) for row in rows])
        write_text(args.out / "study.md", study_table(rows, failed))
    sys.stdout.write(study_table(rows, failed))
    sys.stdout.write(f"\n{args.out / 'study.md'} written\n")
    return 1 if failed else 0


def _outcomes(
    chosen: Sequence[Case], out: Path, spread: Spread, tell: Callable[[str], None]
) -> Iterator[tuple[Case, str]]:
    """Cases as they are there, and why they are not; first what is finished, then datasets."""
    from rfgs_core.cli.calls import call
    from rfgs_core.study.parts import outcomes
    from rfgs_core.study.price import timed_work

    def generate(part: CasePart) -> None:
        with timed_work("generate", part.case, out):
            call(*part.case.generate(out))

    def finished(part: CasePart) -> bool:
        return (out / part.case.run / "metrics.json").exists()

    cases = [CasePart(case) for case in chosen]
    for part, failure in outcomes(cases, out, spread, finished, generate, tell):
        yield part.case, failure
