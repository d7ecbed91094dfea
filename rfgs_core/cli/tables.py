# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench table1`, `table2`, `table3`: the paper's tables, measured."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rfgs_core.errors import RfgsError

if TYPE_CHECKING:
    from rfgs_core.study.cells import SizeName, TableName


def make_table(
    name: TableName, out: Path | None, size_name: SizeName, seeds: int | None, file: Path | None
) -> int:
    """Makes what is missing of the table, prints it and writes OUT/NAME.md.

    Args:
        name: Which of the paper's tables.
        out: Folder of datasets, runs and cells.
        size_name: How much of everything.
        seeds: Trainings of each method; None takes what the size has.
        file: Also write the rows here.

    Returns:
        0 when the table holds all cells, else 1.

    Raises:
        RfgsError: There is no folder to work in.
    """
    from dataclasses import asdict

    from tqdm import tqdm

    from rfgs_core.bench import hardware
    from rfgs_core.cli.calls import call
    from rfgs_core.evaluate.provenance import now
    from rfgs_core.files import write_json, write_text
    from rfgs_core.study.cell_rows import method_rows, method_table
    from rfgs_core.study.cells import SIZES, TABLES, cells, make, stored

    if out is None:
        raise RfgsError(f"bench {name}: expected --out FOLDER for its datasets, runs and cells")
    if out.exists() and not out.is_dir():
        raise RfgsError(f"{out} is a file; expected a folder, choose another --out")
    size = SIZES[size_name]
    chosen = cells(TABLES[name], size, seeds or size.seeds)
    results, failed = [], {}
    with tqdm(chosen, desc=name, unit="cell") as bar:
        for cell in bar:
            bar.set_postfix_str(cell.name)
            try:
                if not (out / cell.dataset / "dataset.json").exists():
                    call(*cell.generate(out, size))
                results.append(stored(cell, out, size) or make(cell, out, size))
            except RfgsError as error:
                failed[cell.name] = str(error)
            rows = method_rows(results)
            write_text(out / f"{name}.md", method_table(rows))
            if file is not None:
                found = {"rows": [asdict(row) for row in rows], "failed": failed}
                write_json(
                    file, {"size": size_name, **asdict(size), **found, **hardware(), "date": now()}
                )
    sys.stdout.write(method_table(method_rows(results)))
    for cell_name, why in failed.items():
        sys.stdout.write(f"failed, and in no row: {cell_name}: {why}\n")
    return 1 if failed else 0
