# SPDX-License-Identifier: Apache-2.0
"""The command line: overview, unknown words, and one clear line per user mistake."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

from rfgs_core.cli import COMMANDS, main
from rfgs_core.cli.demo import DemoArgs, Stages, keep_settings
from rfgs_core.cli.info import find_blender
from rfgs_core.errors import RfgsError

TINY = ["--gaussians", "40", "--iterations", "1", "--no-shader"]


def error_line(arguments: list[str], capsys) -> str:
    """Runs a command that must fail; returns its only line."""
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = [line for line in err.splitlines() if line]
    assert len(lines) == 1, err
    assert lines[0].startswith("error: ")
    return lines[0]


def test_the_overview_lists_every_command_with_a_summary(capsys) -> None:
    assert main(["--help"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for name in COMMANDS:
        rows = [line.split() for line in out.splitlines() if line.split()[:1] == [name]]
        assert len(rows) == 1, name
        assert len(rows[0]) > 3


def test_no_command_shows_the_overview_and_fails(capsys) -> None:
    assert main([]) == 2
    assert "usage: rfgs COMMAND" in capsys.readouterr().out


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself(name: str, capsys) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([name, "--help"])
    assert stopped.value.code == 0
    assert f"usage: rfgs {name}" in capsys.readouterr().out


def test_an_unknown_command_fails_without_a_traceback() -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "rfgs_core.cli", "trian"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 2
    assert answer.stdout == ""
    assert answer.stderr.count("\n") == 1
    assert answer.stderr.startswith("error: unknown command 'trian'; expected one of info, demo")


def test_train_without_a_dataset(tmp_path: Path, capsys) -> None:
    out = tmp_path / "run"
    line = error_line(["train", str(tmp_path), "--radio", "wifi", "--out", str(out)], capsys)
    assert "no dataset there" in line
    assert not out.exists()


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--radio", "radar"], "has no radio 'radar'; it has wifi"),
        (["--radio", "wifi", "--temporal", "-1"], "--temporal -1.0: expected at least 0"),
        (["--radio", "wifi", "--settle", "2"], "--settle 2.0: expected a share from 0 to 1"),
        (["--radio", "wifi", "--without", "prune"], "expected --objective paper or both"),
        (["--radio", "wifi", "--coarse", "1.5"], "--coarse 1.5: expected a share from 0 to 1"),
        (
            ["--radio", "wifi", "--coarse", "0.5", "--observe", "delay_power"],
            "--coarse narrows the band of tones",
        ),
        (["--radio", "wifi", "--frames", "one"], "--frames 'one': expected FIRST:LAST"),
        (["--radio", "wifi", "--frames", "7:9"], "none of these is there; there are [1, 2]"),
        (["--radio", "wifi", "--sequence", "no"], "no sequence 'no'; expected one of tiny"),
        (["--radio", "wifi", "--gaussians", "0"], "--gaussians 0: expected at least 1"),
        (["--radio", "wifi", "--iterations", "-1"], "--iterations -1: expected at least 0"),
    ],
)
def test_train_refuses_what_the_dataset_does_not_hold(
    tiny_dataset: Path, tmp_path: Path, capsys, extra: list[str], message: str
) -> None:
    out = tmp_path / "run"
    line = error_line(["train", str(tiny_dataset), "--out", str(out), *extra], capsys)
    assert message in line
    assert not out.exists()


def test_train_refuses_a_folder_with_other_files(
    tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "thesis.txt").write_text("precious")
    arguments = ["train", str(tiny_dataset), "--radio", "wifi", "--out", str(tmp_path)]
    assert "is not empty and not a run" in error_line(arguments, capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_train_then_other_settings_in_the_same_folder(
    tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    out = tmp_path / "run"
    arguments = ["train", str(tiny_dataset), "--radio", "wifi", "--out", str(out), *TINY]
    assert main([*arguments, "--frames", "1"]) == 0
    assert "1 frames, 40 Gaussians" in capsys.readouterr().out
    before = (out / "gaussians/000001.ply").read_bytes()
    line = error_line([*arguments, "--frames", "1", "--seed", "1"], capsys)
    assert "holds a run with another seed;" in line
    line = error_line([*arguments, "--frames", "1:2"], capsys)
    assert "holds a run with another frames;" in line
    assert (out / "gaussians/000001.ply").read_bytes() == before


def test_a_folder_where_out_should_go_that_is_a_file(
    tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "run").write_text("a file")
    arguments = ["train", str(tiny_dataset), "--radio", "wifi", "--out", str(tmp_path / "run")]
    assert "is a file" in error_line(arguments, capsys)


def test_train_refuses_a_run_whose_settings_are_damaged(
    tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    (tmp_path / "config.json").write_text("[1]")
    arguments = ["train", str(tiny_dataset), "--radio", "wifi", "--out", str(tmp_path)]
    assert "config.json" in error_line(arguments, capsys)


def test_stages_run_once_and_again_when_their_result_is_gone(tmp_path: Path) -> None:
    done, calls = tmp_path / "result", []

    def work() -> None:
        calls.append(1)
        done.write_text("x")

    Stages(tmp_path).run("first", done, work)
    Stages(tmp_path).run("first", done, work)
    assert len(calls) == 1
    assert list(json.loads((tmp_path / "timings.json").read_text())) == ["first"]
    done.unlink()
    Stages(tmp_path).run("first", done, work)
    # A result without a recorded time is of an interrupted stage.
    (tmp_path / "timings.json").unlink()
    Stages(tmp_path).run("first", done, work)
    assert len(calls) == 3


def test_a_demo_with_other_settings_is_not_mixed_in(tmp_path: Path) -> None:
    keep_settings(DemoArgs(out=tmp_path))
    keep_settings(DemoArgs(out=tmp_path))
    with pytest.raises(RfgsError, match="holds a demo with another frames, seed; choose another"):
        keep_settings(DemoArgs(out=tmp_path, frames="1:3", seed=1))


def test_blender_is_taken_from_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "blender"
    program.write_text("")
    monkeypatch.setenv("BLENDER", str(program))
    assert find_blender() == program
    program.unlink()
    assert find_blender() != program


#: Every command that writes what OUT names, with what it must be told before that.
WRITING: dict[str, tuple[str, ...]] = {
    "ablate": ("data", "--radio", "wifi"),
    "compare": ("run", "run"),
    "csi": ("run",),
    "demo": (),
    "encode": ("data", "--radio", "wifi"),
    "export": ("run",),
    "predict": ("run", "--tx", "0,0,1"),
    "render": ("run",),
    "study": (),
    "train": ("data", "--radio", "wifi"),
}


def test_no_command_that_writes_is_forgotten() -> None:
    kinds = {
        name: getattr(importlib.import_module(f"rfgs_core.cli.{file}"), kind)
        for name, (file, kind) in COMMANDS.items()
    }
    assert {
        name for name, kind in kinds.items() if any(row.name == "out" for row in fields(kind))
    } == set(WRITING)


@pytest.mark.parametrize("name", WRITING)
def test_a_place_that_cannot_be_made_is_refused_first(name: str, tmp_path: Path, capsys) -> None:
    (tmp_path / "file").write_text("")
    places = [tmp_path / "file" / "below" / "out.npz"]
    # Not even the administrator makes a folder there, and the system calls it missing.
    places += [Path("/proc/rfgs/out.npz")] if Path("/proc/self").exists() else []
    for place in places:
        option = [] if name == "study" else ["--out"]
        line = error_line([name, *WRITING[name], *option, str(place)], capsys)
        assert line.startswith(f"error: {place}: nothing can be made there (")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
