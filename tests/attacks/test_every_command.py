# SPDX-License-Identifier: Apache-2.0
"""Every command: no link leads out of the folder that it fills, and no pipe keeps it waiting."""

from __future__ import annotations

import dataclasses
import importlib
import os
import shutil
import signal
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest
from argument_classes import argument_classes
from capture_files import feitcsi_file
from whole_metrics import whole_metrics

import dataset_factory.cli
import rfgs_core.cli
from rfgs_core.capture.layout_file import EXAMPLE
from rfgs_core.run import Run, open_run
from rfgs_core.seals import write_sealed_json

PROGRAMS: dict[str, Any] = {"rfgs": rfgs_core.cli, "rfgs-factory": dataset_factory.cli}
#: Whatever takes longer waits for a pipe [s].
LIMIT_S = 60.0
#: Arguments that say where to write.
OUTPUTS = ("out", "json", "video", "picture", "record", "markdown")

_TRAIN = (
    "train DATA --radio wifi --gaussians 40 --iterations 1 --people 1 --posture standing "
    "--limbs off --no-shader"
)
_GENERATE = "rfgs-factory generate living_room_walk --radio wifi"
#: What a command fills, and a link in it where the command would read or write.
FOLDERS = {
    "rfgs study OUT --scenes living_room_walk --conditions clean --radios wifi --seeds 1": "runs",
    "rfgs bench table1 --size smoke --seeds 1 --out OUT": "cells",
    "rfgs bench gallery --scenes living_room_walk --out OUT": "cells",
    "rfgs bench sensitivity --sweeps devices --out OUT": "setups",
    "rfgs demo --out OUT": "settings.json",
    "rfgs demo --frames 10:20:10 --out OUT": "dataset",
    "rfgs addon build --out OUT": "addon_rfgs-0.1.0.zip",
    "rfgs render RUN --split train --out OUT": "cam00",
    "rfgs inspect CAPTURE --out OUT": "capture.png",
    f"rfgs {_TRAIN} --out OUT": "gaussians",
    f"{_GENERATE} --frames 10:20:10 --no-images --out OUT": "log",
    f"{_GENERATE} --frames 20:30:10 --no-images --out OUT": ".work",
    "rfgs-factory preview DATA --out OUT": "index.html",
    "rfgs-factory worlds --radio wifi --count 1 --frames 1 --out OUT": "worlds.json",
}
#: Commands of many parts: a dataset is there, and each part is refused.
MANY = ("study", "table1", "gallery")
#: Takes seconds, and set-ups run it.
SELFTEST = "rfgs selftest --json OUT.json"
#: Files that a command writes; a link of that name goes, and what it leads to stays.
FILES = [
    "rfgs export RUN --out OUT.ply",
    "rfgs compare RUN RUN --out OUT.html",
    "rfgs csi RUN --out OUT.png",
    "rfgs predict RUN --tx 1,1,1 --rx 2,2,1 --out OUT.npz",
    "rfgs render RUN --split train --frames 1 --video OUT.webp",
    "rfgs room DATA --json OUT.json",
    "rfgs encode DATA --radio wifi --steps 1 --out OUT.npz",
    "rfgs-factory check living_room_walk --json OUT.json",
    SELFTEST,
]
#: Folders that are made anew and must not be there, whatever they are.
FRESH = [
    "rfgs import CAPTURE --layout LAYOUT --out OUT",
    "rfgs-factory convert DATA --to nerf2 --out OUT",
]
#: Outputs that take minutes or a browser to reach; they are written by the same functions.
SLOW = {
    ("rfgs", "limbs", "out"), ("rfgs", "view", "picture"), ("rfgs", "view", "record"),
    ("rfgs", "bench", "json"), ("rfgs-factory", "bench", "json"), ("rfgs-factory", "verify", "out"),
    ("rfgs-factory", "verify", "markdown"), ("rfgs-factory", "tracers", "json"),
    ("rfgs-factory", "tracers", "markdown"), ("rfgs-factory", "plan", "out"),
    ("rfgs-factory", "coverage", "out"),
}  # fmt: skip
#: A pipe in place of each file and folder that a command reads.
PIPES = [
    "rfgs encode PIPE --radio wifi --out OUT.npz",
    "rfgs train PIPE --radio wifi --out OUT",
    f"rfgs {_TRAIN} --out OUT --encoder cnn:PIPE",
    *(f"rfgs {name} PIPE" for name in ("eval", "pose", "view", "report", "csi", "room", "inspect")),
    "rfgs render PIPE --out OUT",
    "rfgs export PIPE --out OUT.ply",
    "rfgs compare PIPE RUN",
    "rfgs compare RUN PIPE",
    "rfgs predict PIPE --tx 1,1,1 --rx 2,2,1",
    "rfgs predict RUN --tx 1,1,1 --rx 2,2,1 --also PIPE",
    "rfgs import PIPE --layout LAYOUT --out OUT",
    "rfgs import CAPTURE --layout PIPE --out OUT",
    "rfgs import CAPTURE --layout LAYOUT --empty PIPE --out OUT",
    "rfgs live --layout PIPE",
    "rfgs live --replay PIPE --layout LAYOUT --no-view",
    "rfgs limbs --radio wifi --frames 64 --kept 64 --out OUT.safetensors",
    "rfgs addon install --blender PIPE",
    "rfgs bench training --dataset PIPE",
    "rfgs bench limbs --radio mmwave --dataset DATA --network PIPE",
    "rfgs bench posenets --out OUT --dataset PIPE",
    "rfgs bench real --data PIPE",
    "rfgs bench blender --blender PIPE",
    *(f"rfgs-factory {name} PIPE" for name in ("check", "validate", "preview", "stats", "bench")),
    *(
        f"rfgs-factory {name} PIPE --radio wifi --out OUT"
        for name in ("plan", "generate", "coverage")
    ),
    "rfgs-factory tracers PIPE",
    "rfgs-factory worlds --radio wifi --recording PIPE --out OUT",
    "rfgs-factory impair PIPE --impairments lab",
    "rfgs-factory impair DATA --impairments PIPE",
    "rfgs-factory convert PIPE --to nerf2 --out OUT",
    "rfgs-factory check living_room_walk --radio PIPE.yaml",
    "rfgs-factory check living_room_walk --scene-config PIPE.yaml",
    "rfgs-factory check living_room_walk --blender PIPE",
    f"{_GENERATE} --impairments PIPE.json --out OUT",
    f"{_GENERATE} --blender PIPE --out OUT",
]


class Waiting(BaseException):
    """A command has not ended in time."""


@pytest.fixture
def impatient() -> Iterator[None]:
    def late(*_: Any) -> NoReturn:
        raise Waiting

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def places(tiny_dataset: Path, small_run: Run, tmp_path: Path) -> dict[str, Path]:
    """Words of the tables → what stands for them."""
    run = Path(shutil.copytree(small_run.path, tmp_path / "run"))
    open_run(run).with_dataset(tiny_dataset)
    write_sealed_json(run / "metrics.json", whole_metrics())
    feitcsi_file(tmp_path / "capture.csi")
    (tmp_path / "layout.yaml").write_text(EXAMPLE)
    return {
        "DATA": tiny_dataset, "RUN": run, "CAPTURE": tmp_path / "capture.csi",
        "LAYOUT": tmp_path / "layout.yaml", "OUT": tmp_path / "out", "PIPE": tmp_path / "pipe",
    }  # fmt: skip


def call(command: str, places: dict[str, Path]) -> int:
    """Runs a command of the tables; the exit code."""
    for word, place in places.items():
        command = command.replace(word, str(place))
    program, *arguments = command.split()
    return PROGRAMS[program].main(arguments)


def victim(tmp_path: Path) -> Path:
    folder = tmp_path / "victim"
    folder.mkdir()
    (folder / "kept").write_text("mine")
    return folder


def untouched(folder: Path) -> bool:
    return [file.name for file in folder.iterdir()] == ["kept"] and (
        folder / "kept"
    ).read_text() == "mine"


@pytest.mark.parametrize("command", FOLDERS)
def test_no_link_leads_out_of_a_folder_that_is_filled(
    command: str, places: dict[str, Path], tmp_path: Path, impatient: None, capfd: Any
) -> None:
    elsewhere, link = victim(tmp_path), places["OUT"] / FOLDERS[command]
    places["OUT"].mkdir()
    if any(name in command for name in MANY):
        for radio in ("wifi-depth1", "wifi", "mmwave"):
            shutil.copytree(places["DATA"], places["OUT"] / f"data/living_room_walk-{radio}")
    if "rfgs train" in command:
        assert call(command, places) == 0
        shutil.rmtree(link)
        (places["OUT"] / "checkpoints/000002.npz").unlink()
    link.symlink_to(elsewhere / "kept" if link.suffix in (".png", ".zip", ".html") else elsewhere)

    assert call(command, places) in (1, 2)
    said = "".join(capfd.readouterr())
    assert "Traceback" not in said
    assert "a symbolic link" in said
    assert link.is_symlink()
    assert untouched(elsewhere)


@pytest.mark.parametrize(
    "command",
    [pytest.param(row, marks=[pytest.mark.slow] * (row == SELFTEST)) for row in FILES],
)
def test_files_are_not_written_where_a_link_leads(
    command: str, places: dict[str, Path], tmp_path: Path, impatient: None, capfd: Any
) -> None:
    elsewhere = victim(tmp_path)
    name = next(word for word in command.split() if word.startswith("OUT."))
    link = Path(name.replace("OUT", str(places["OUT"])))
    link.symlink_to(elsewhere / "kept")

    code = call(command, places)
    assert "Traceback" not in capfd.readouterr().err
    assert untouched(elsewhere)
    assert code == 0 and not link.is_symlink() and link.stat().st_size


@pytest.mark.parametrize("command", FRESH)
@pytest.mark.parametrize("dangling", [False, True])
def test_folders_are_not_made_where_a_link_leads(
    command: str, dangling: bool, places: dict[str, Path], tmp_path: Path, capfd: Any
) -> None:
    elsewhere = victim(tmp_path)
    places["OUT"].symlink_to(elsewhere / "new" if dangling else elsewhere)
    call(command, places)
    assert "Traceback" not in capfd.readouterr().err
    assert untouched(elsewhere)


def test_the_tables_know_every_output() -> None:
    known = {(row.split()[0], row.split()[1], _output(row)) for row in [*FOLDERS, *FILES, *FRESH]}
    there = {
        (name, command, field.name)
        for name, program in PROGRAMS.items()
        for command, (file, kind) in program.COMMANDS.items()
        for field in _fields(f"{program.__name__}.{file}", kind)
        if field.name in OUTPUTS and "Path" in str(field.type)
    }
    assert known | SLOW == there
    assert not known & SLOW


def _output(row: str) -> str:
    """The argument of a row that says where to write."""
    words = row.split()
    before = words[next(index for index, word in enumerate(words) if word[:3] == "OUT") - 1]
    return before.removeprefix("--") if before.startswith("--") else "out"


def _fields(module: str, kind: str) -> tuple[dataclasses.Field[Any], ...]:
    classes = argument_classes(getattr(importlib.import_module(module), kind))
    return tuple(field for made in classes for field in dataclasses.fields(made))


@pytest.mark.parametrize("command", PIPES)
def test_no_command_waits_for_a_pipe(
    command: str, places: dict[str, Path], impatient: None, capfd: Any
) -> None:
    pipe = places["PIPE"]
    for place in (pipe, *(pipe.with_suffix(f".{end}") for end in ("yaml", "json"))):
        os.mkfifo(place)
    if "limbs --radio wifi" in command:
        os.mkfifo(places["OUT"].with_suffix(".partial"))

    assert call(command, places) in (1, 2)
    said = capfd.readouterr().err
    assert "Traceback" not in said
    assert len([line for line in said.splitlines() if line.startswith("error: ")]) == 1


def test_the_tables_know_every_input() -> None:
    asked = {(row.split()[0], row.split()[1]) for row in PIPES}
    reading = {
        (name, command)
        for name, program in PROGRAMS.items()
        for command, (file, kind) in program.COMMANDS.items()
        if _reads(f"{program.__name__}.{file}", kind)
    }
    assert reading <= asked


def _reads(module: str, kind: str) -> bool:
    """Whether a command takes the name of a file or folder to read."""
    classes = argument_classes(getattr(importlib.import_module(module), kind))
    hints = [pair for made in classes for pair in typing.get_type_hints(made).items()]
    return any("Path" in str(hint) for name, hint in hints if name not in OUTPUTS)
