# SPDX-License-Identifier: Apache-2.0
"""Parts of a study are the same from any number of workers, and what fails takes nothing along."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json, write_json
from rfgs_core.schedule.spread import Spread
from rfgs_core.study.cells import CellPart, stored
from rfgs_core.study.paper_tables import Cell, Size
from rfgs_core.study.parts import datasets_missing, made


@dataclass(frozen=True)
class Doubling:
    """Writes twice the number of its dataset, and notes where it was made."""

    name: str
    dataset: Path

    def __str__(self) -> str:
        return self.name

    @property
    def made(self) -> tuple[Path, ...]:
        return (Path("runs") / self.name, Path("cells") / f"{self.name}.json")

    def make(self, out: Path) -> None:
        run, done = (out / name for name in self.made)
        run.mkdir(parents=True)
        write_json(run / "half.json", os.getpid())
        number = read_json(out / self.dataset / "number.json")
        if number == 13:
            raise RfgsError(f"{out / self.dataset}: unlucky")
        write_json(done, 2 * number)


def doublings(out: Path) -> list[Doubling]:
    for name, number in (("a", 4), ("b", 13)):
        write_json(out / "data" / name / "number.json", number)
    return [Doubling(f"{of}{index}", Path("data") / of) for of in "ab" for index in range(2)]


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_what_fails_is_named_and_the_others_are_made(workers: int, tmp_path: Path) -> None:
    parts = doublings(tmp_path)
    if workers > 1:
        # What an earlier run began is made anew.
        write_json(tmp_path / "runs/a1/begun.json", 1)
    outcomes = {part.name: why for part, why in made(parts, tmp_path, Spread(workers))}
    assert outcomes.pop("a0") == outcomes.pop("a1") == ""
    assert sorted(outcomes) == ["b0", "b1"]
    place = "data/b" if workers > 1 else str(tmp_path / "data/b")
    assert all(why.startswith(f"{place}: unlucky") for why in outcomes.values())
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.json")}
    assert {"cells/a0.json", "cells/a1.json", "runs/a0/half.json", "runs/a1/half.json"} <= files
    assert not {"cells/b0.json", "cells/b1.json", "runs/a1/begun.json"} & files
    assert read_json(tmp_path / "cells/a0.json") == 8
    here = read_json(tmp_path / "runs/a0/half.json") == os.getpid()
    assert here == (workers == 1)
    # Nothing else is left: no scratch, no dataset that came back.
    assert {path.name for path in tmp_path.iterdir()} - {"log"} == {"data", "runs", "cells"}


@pytest.mark.parametrize("workers", [1, 2])
def test_a_stopped_study_keeps_what_is_finished(workers: int, tmp_path: Path) -> None:
    parts = doublings(tmp_path)[:2]
    outcomes = made(parts, tmp_path, Spread(workers))
    first, why = next(outcomes)
    # As Ctrl-C does: nothing else is begun, and no worker or scratch is left.
    outcomes.close()
    assert why == "" and not (tmp_path / ".work").exists()
    done = tmp_path / first.made[-1]
    before = done.stat().st_mtime_ns
    rest = [part for part in parts if not (tmp_path / part.made[-1]).exists()]
    assert first not in rest
    assert all(why == "" for _, why in made(rest, tmp_path, Spread(workers)))
    assert [read_json(tmp_path / part.made[-1]) for part in parts] == [8, 8]
    assert done.stat().st_mtime_ns == before


def test_no_link_leads_out_of_what_workers_fill(tmp_path: Path) -> None:
    from rfgs_core.links import filled

    (tmp_path / "victim").mkdir()
    out = tmp_path / "out"
    parts = doublings(out)[:2]
    (out / "runs").symlink_to(tmp_path / "victim")
    with pytest.raises(RfgsError, match="a symbolic link"), filled(out):
        list(made(parts, out, Spread(2)))
    assert not list((tmp_path / "victim").iterdir())


def test_a_dataset_is_made_once_and_its_failure_is_kept(tmp_path: Path) -> None:
    wanted = [Doubling(f"{of}{index}", Path(of)) for of in "ab" for index in range(2)]
    asked = []

    def generate(one: Doubling) -> None:
        asked.append(one.name)
        if one.dataset == Path("b"):
            raise RfgsError("no wall")
        write_json(tmp_path / one.dataset / "dataset.json", {})

    assert datasets_missing(wanted, tmp_path, generate, print) == {Path("b"): "no wall"}
    assert asked == ["a0", "b0"]


@pytest.mark.slow
def test_cells_have_the_same_bytes_from_any_number_of_workers(
    tiny_dataset: Path, tmp_path: Path
) -> None:
    size = Size(("living_room_walk",), 1, "1:2", 3, 8, 2, 6, 0)
    methods = ("rfgs", "paper_prior", "nerf_features", "ngp_propagation_prior")
    cells = [Cell("living_room_walk", "wifi", method, 0) for method in methods]
    found = []
    for workers in (1, 2):
        out = tmp_path / str(workers)
        shutil.copytree(tiny_dataset, out / cells[0].dataset)
        parts = [CellPart(cell, size) for cell in cells]
        assert [why for _, why in made(parts, out, Spread(workers))] == [""] * len(cells)
        rows = [stored(cell, out, size) for cell in cells]
        assert all(row is not None for row in rows)
        clouds = {
            path.relative_to(out): path.read_bytes() for path in (out / "runs").rglob("*.ply")
        }
        found.append(([row["methods"] for row in rows if row], clouds))
    assert found[0] == found[1]
    # Of each training two frames, what stands still, and the file for viewers.
    assert len(found[0][1]) == 2 * 4
