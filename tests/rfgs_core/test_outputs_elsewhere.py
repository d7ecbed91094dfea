# SPDX-License-Identifier: Apache-2.0
"""Outputs within a dataset or a run: refused, as its own commands would read them as theirs."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from dataset_factory.cli import main as factory
from rfgs_core.cli import main as rfgs
from rfgs_core.errors import RfgsError
from rfgs_core.files import refuse_inside
from rfgs_core.run import Run, open_run

PROGRAMS = {"rfgs": rfgs, "rfgs-factory": factory}
#: Commands that would replace files of a dataset or a run, or put something among them.
WITHIN = [
    "rfgs export RUN --frame 2 --out RUN/gaussians/000001.ply",
    "rfgs encode DATA --radio wifi --steps 1 --out RUN/shader.npz",
    "rfgs predict RUN --tx 1,1,1 --rx 2,2,1 --out RUN/pose.npz",
    "rfgs csi RUN --out RUN/pose.png",
    "rfgs compare RUN RUN --out RUN/report.html",
    "rfgs render RUN --split train --frames 1 --out DATA/tiny/images",
    "rfgs render RUN --split train --frames 1 --video RUN/pictures.webp",
    "rfgs view RUN --picture RUN/pose.png",
    "rfgs room DATA --json DATA/dataset.json",
    "rfgs train DATA --radio wifi --out DATA/tiny/run",
    "rfgs study DATA",
    "rfgs bench gallery --out RUN",
    "rfgs demo --out RUN",
    "rfgs-factory convert DATA --to nerf2 --out DATA/nerf2",
    "rfgs-factory preview DATA --out DATA/tiny",
    "rfgs-factory verify --only friis --out RUN/physics",
    "rfgs-factory verify --only friis --markdown RUN/physics.md",
    "rfgs-factory worlds --radio wifi --count 1 --out DATA/worlds",
]


@pytest.fixture
def places(tiny_dataset: Path, small_run: Run, tmp_path: Path) -> dict[str, Path]:
    """Words of the tables, and copies that stand for them."""
    data = Path(shutil.copytree(tiny_dataset, tmp_path / "data"))
    run = Path(shutil.copytree(small_run.path, tmp_path / "run"))
    open_run(run).with_dataset(data)
    return {"DATA": data, "RUN": run}


def call(command: str, places: dict[str, Path]) -> int:
    for word, place in places.items():
        command = command.replace(word, str(place))
    program, *arguments = command.split()
    return PROGRAMS[program](arguments)


def contents(places: dict[str, Path]) -> dict[Path, bytes | None]:
    """Every file and folder of the copies."""
    found = [entry for place in places.values() for entry in place.rglob("*")]
    return {entry: entry.read_bytes() if entry.is_file() else None for entry in found}


@pytest.mark.parametrize("command", WITHIN)
def test_nothing_is_written_among_files_of_a_dataset_or_a_run(
    command: str, places: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(places)
    assert call(command, places) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert "whose files are its own; choose another place" in err
    assert contents(places) == before


@pytest.mark.parametrize(
    "command",
    [
        "rfgs csi RUN --out RUN/predictions/mine.png",
        "rfgs csi RUN --out RUN/../mine.png",
        "rfgs-factory preview DATA --out DATA/log/preview",
    ],
)
def test_pictures_go_beside_and_where_they_go_by_themselves(
    command: str, places: dict[str, Path]
) -> None:
    assert call(command, places) == 0


def test_a_place_that_a_link_leads_to_is_known(places: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(places["RUN"])
    with pytest.raises(RfgsError, match=f"link/a.ply lies in a run, {places['RUN']}, whose files"):
        refuse_inside(tmp_path / "link" / "a.ply")
    with pytest.raises(RfgsError, match="link is a run, whose files are its own"):
        refuse_inside(tmp_path / "link")
    refuse_inside(tmp_path / "link", itself=False)


def test_no_folder_is_a_run_by_the_name_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text('{"schema": "mine/1"}')
    refuse_inside(tmp_path / "a.ply")
