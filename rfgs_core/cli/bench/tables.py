# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench table1`, `table2`, `table3`: the paper's tables, measured."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import tyro

from rfgs_core.cli.bench.numbers import need_at_least_one
from rfgs_core.cli.spreading import Spreading, need_folder, watched
from rfgs_core.device import Device
from rfgs_core.study.paper_tables import Cell, Size, SizeName, TableName

if TYPE_CHECKING:
    from rfgs_core.schedule.spread import Spread
    from rfgs_core.study.cell_rows import MethodRow


@dataclass(frozen=True, kw_only=True)
class PaperTable:
    """One of the paper's tables."""

    name: ClassVar[TableName]

    out: Path
    """Folder of datasets, runs and cells; what is finished is kept, and the same command goes on
    where it stopped."""
    size: SizeName = "smoke"
    """smoke: one scene and seed, minutes; paper-cpu: the study's four, three seeds and the paper's
    steps, hours; full: five seeds and larger neural fields, days."""
    seeds: int | None = None
    """Trainings of each method; left out: what the size has."""
    scenes: tuple[str, ...] = ()
    """Which of the twelve scenes; left out: those of the size."""
    frames: str | None = None
    """Which frames of each scene, as in 10 or 10:55:15; left out: those of the size. A folder has
    datasets of the same frames throughout."""
    radios: tuple[str, ...] = ()
    """Which radios; left out: those of the table."""
    methods: tuple[str, ...] = ()
    """Which methods; left out: those of the table. rfgs brings all that need no training."""
    device: Device = "cpu"
    """Where Gaussians are trained: cpu, or cuda, the current GPU."""
    spread: Annotated[Spreading, tyro.conf.arg(name="")] = field(default_factory=Spreading)
    json: Path | None = None
    """Also write the rows to this file."""

    def run(self) -> int:
        """Makes what is missing, prints the table and writes OUT/NAME.md and OUT/NAME.png.

        Returns:
            0 when the table holds all cells, else 1.

        Raises:
            RfgsError: An option is out of range, or there are no workers.
        """
        from rfgs_core.device import need_device
        from rfgs_core.frames import parse_frames
        from rfgs_core.report.strip import write_strip
        from rfgs_core.study.cell_rows import method_rows, method_table
        from rfgs_core.study.cells import stored
        from rfgs_core.study.paper_tables import SIZES, cells, narrowed

        need_at_least_one(seeds=self.seeds)
        need_device(self.device)
        need_folder(self.out)
        spread = self.spread.checked()
        size = SIZES[self.size]
        if self.frames is not None:
            parse_frames(self.frames)
            size = replace(size, frames=self.frames)
        table, size = narrowed(self.name, size, self.scenes, self.radios, self.methods)
        chosen = cells(table, size, self.seeds or size.seeds)
        results: dict[Cell, dict[str, Any]] = {}
        failed: dict[str, str] = {}
        rows = []
        walk = partial(outcomes, chosen, self.out, size, self.device, spread)
        for cell, failure in watched(walk, len(chosen), self.name, "cell"):
            found = None if failure else stored(cell, self.out, size)
            if found is None:
                failed[cell.name] = failure
            else:
                results[cell] = found
            rows = method_rows(_in_order(chosen, results).values())
            self._write(rows, failed, size)
        write_strip(self.out / f"{self.name}.png", _in_order(chosen, results), self.out)
        sys.stdout.write(method_table(rows))
        for cell_name, why in failed.items():
            sys.stdout.write(f"failed, and in no row: {cell_name}: {why}\n")
        return 1 if failed else 0

    def _write(self, rows: Sequence[MethodRow], failed: dict[str, str], size: Size) -> None:
        """Writes the table so far."""
        from dataclasses import asdict

        from rfgs_core.bench import hardware
        from rfgs_core.evaluate.provenance import now
        from rfgs_core.files import write_json, write_text
        from rfgs_core.study.cell_rows import method_table

        write_text(self.out / f"{self.name}.md", method_table(rows))
        if self.json is not None:
            found = {"rows": [asdict(row) for row in rows], "failed": failed}
            about = {"size": self.size, **asdict(size)}
            write_json(self.json, {**about, **found, **hardware(), "date": now()})


def _in_order(
    chosen: Sequence[Cell], results: dict[Cell, dict[str, Any]]
) -> dict[Cell, dict[str, Any]]:
    """What there is in the order of the table, whoever was first."""
    return {cell: results[cell] for cell in chosen if cell in results}


def outcomes(
    chosen: Sequence[Cell],
    out: Path,
    size: Size,
    device: Device,
    spread: Spread,
    tell: Callable[[str], None],
) -> Iterator[tuple[Cell, str]]:
    """Cells as they are there, and why they are not; first what is finished, then datasets."""
    from rfgs_core.cli.calls import call
    from rfgs_core.study import parts
    from rfgs_core.study.cells import CellPart, stored

    def generate(part: CellPart) -> None:
        call(*part.cell.generate(out, size))

    def finished(part: CellPart) -> bool:
        return stored(part.cell, out, size) is not None

    cells = [CellPart(cell, size, device) for cell in chosen]
    for part, failure in parts.outcomes(cells, out, spread, finished, generate, tell):
        yield part.cell, failure


@dataclass(frozen=True, kw_only=True)
class Table1(PaperTable):
    """The paper's first table: methods and baselines x Wi-Fi and mmWave."""

    name = "table1"


@dataclass(frozen=True, kw_only=True)
class Table2(PaperTable):
    """The paper's second table: its recipe less one part at a time, on Wi-Fi."""

    name = "table2"


@dataclass(frozen=True, kw_only=True)
class Table3(PaperTable):
    """The paper's third table: Wi-Fi, mmWave, UWB and SAR, each beside its baselines."""

    name = "table3"
