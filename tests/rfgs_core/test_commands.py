# SPDX-License-Identifier: Apache-2.0
"""The command line: overview, unknown words, and one clear line per user mistake."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import pytest
from argument_classes import argument_classes

from rfgs_core.cli import COMMANDS, main
from rfgs_core.cli.demo import DemoArgs, Stages, keep_settings, refuse_other_settings
from rfgs_core.cli.info import find_blender
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.schema import read_dataset_info
from rfgs_core.dataset.writer import write_dataset_info
from rfgs_core.errors import RfgsError
from rfgs_core.gaussians.ply import read_ply
from rfgs_core.run import Run

PICTURES = ("images", "depth", "normal", "mask")
PAPER = ["--radio", "wifi", "--recipe", "paper"]
TINY = ["--gaussians", "40", "--iterations", "1", "--posture", "standing", "--no-shader"]


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
        (["--radio", "wifi", "--without", "prune"], "expected --objective paper or both"),
        (["--radio", "wifi", "--frames", "one"], "--frames 'one': expected FIRST:LAST"),
        (["--radio", "wifi", "--frames", "7:9"], "none of these is there; there are [1, 2]"),
        (["--radio", "wifi", "--sequence", "no"], "no sequence 'no'; expected one of tiny"),
        (["--radio", "wifi", "--gaussians", "0"], "--gaussians 0: expected at least 1"),
        (["--radio", "wifi", "--iterations", "-1"], "--iterations -1: expected at least 0"),
        (["--radio", "wifi", "--channel", "impaired"], "holds no impaired channels"),
        (["--radio", "wifi", "--background", "learned"], "expected at least 3 to learn"),
        (["--radio", "wifi", "--density", "paper"], "reads the sample points of the paper's"),
        (
            ["--radio", "wifi", "--start", "random"],
            "expected --recipe paper with --objective paper",
        ),
        ([*PAPER, "--start", "random", "--objective", "both"], "expected --recipe paper with"),
        ([*PAPER, "--temporal", "0.5"], "--temporal 0.5 holds Gaussians from frame to frame"),
        ([*PAPER, "--calibrate", "phase"], "--calibrate phase finds offsets by the echoes"),
        ([*PAPER, "--people", "2"], "--people 2: --start random knows of no people"),
        ([*PAPER, "--density", "motion"], "--density motion puts Gaussians on bodies"),
        ([*PAPER, "--density", "residual"], "--density residual puts Gaussians on bodies"),
    ],
)
def test_train_refuses_what_the_dataset_does_not_hold(
    tiny_dataset: Path, tmp_path: Path, capsys, extra: list[str], message: str
) -> None:
    out = tmp_path / "run"
    line = error_line(["train", str(tiny_dataset), "--out", str(out), *extra], capsys)
    assert message in line
    assert not out.exists()


def test_train_says_at_the_start_that_no_picture_is_for_the_shader(
    tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    """All pictures of one frame are held out for testing: the other frame's are not."""
    (tested,) = open_dataset(tiny_dataset).sequence().splits["images"]["test_frames"]
    arguments = ["train", str(tiny_dataset), "--radio", "wifi", *TINY[:-1], "--frames", str(tested)]
    said = "training without the shader, so that Gaussians stay grey: all pictures of these"
    # Refused after that line and before any training, as the folder is somebody else's.
    (tmp_path / "thesis.txt").write_text("precious")
    assert main([*arguments, "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err.splitlines()[0].startswith(said)
    out = tmp_path / "run"
    assert main([*arguments, "--out", str(out)]) == 0
    assert said in capsys.readouterr().err
    assert not (out / "shader.npz").exists()
    assert (read_ply(out / f"gaussians/{tested:06d}.ply").f_dc == 0).all(), "mid-grey"


def test_train_says_at_the_start_that_a_dataset_has_no_pictures(
    tiny_dataset: Path, tmp_path: Path, capsys
) -> None:
    data = Path(shutil.copytree(tiny_dataset, tmp_path / "dataset"))
    info = read_dataset_info(data / "dataset.json")
    write_dataset_info(data, replace(info, has=[x for x in info.has if x not in PICTURES]))
    (tmp_path / "run").write_text("a file")
    arguments = ["train", str(data), "--radio", "wifi", "--out", str(tmp_path / "run")]
    assert main(arguments) == 2
    said = "training without the shader, so that Gaussians stay grey: the dataset holds no images"
    assert capsys.readouterr().err.splitlines()[0].startswith(said)
    assert main([*arguments, "--no-shader"]) == 2
    assert "shader" not in capsys.readouterr().err


@pytest.mark.parametrize("command", ["eval", "pose", "csi"])
def test_a_run_that_lacks_frames_is_refused_before_work_on_all_of_them(
    small_run: Run, tmp_path: Path, capsys, command: str
) -> None:
    run = Path(shutil.copytree(small_run.path, tmp_path / "run"))
    (run / "gaussians/000002.features.npz").unlink()
    before = sorted(run.rglob("*"))
    line = error_line([command, str(run)], capsys)
    assert "1 of 2 frames are not trained yet, the first is 2; run the same `rfgs train`" in line
    assert sorted(run.rglob("*")) == before


@pytest.mark.parametrize(
    ("part", "option"),
    [("propagation", "gaussians"), ("training", "gaussians"), ("training", "steps")],
)
def test_bench_refuses_to_time_nothing(part: str, option: str, capsys) -> None:
    words = ["--dataset", "nowhere"] if part == "training" else []
    line = error_line(["bench", part, *words, f"--{option}", "0"], capsys)
    assert line == f"error: --{option} 0: expected at least 1"


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
    assert "1 frame, 40 Gaussians" in capsys.readouterr().out
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
    assert list(Stages(tmp_path).seconds) == ["first"]
    done.unlink()
    Stages(tmp_path).run("first", done, work)
    # A result without a recorded time is of an interrupted stage.
    (tmp_path / "timings.json").unlink()
    Stages(tmp_path).run("first", done, work)
    assert len(calls) == 3


def test_a_demo_with_other_settings_is_not_mixed_in(tmp_path: Path) -> None:
    refuse_other_settings(DemoArgs(out=tmp_path))
    keep_settings(DemoArgs(out=tmp_path))
    refuse_other_settings(DemoArgs(out=tmp_path))
    with pytest.raises(RfgsError, match="holds a demo with another frames, seed; choose another"):
        refuse_other_settings(DemoArgs(out=tmp_path, frames="1:3", seed=1))


def test_a_demo_of_frames_that_cannot_be_leaves_nothing(tmp_path: Path, capfd) -> None:
    """Otherwise the settings that were refused would stand in the way of better ones."""
    out = tmp_path / "demo"
    assert main(["demo", "--out", str(out), "--frames", "30:10"]) == 2
    assert "--frames '30:10': expected FIRST <= LAST" in capfd.readouterr().err
    assert not out.exists()


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
    "addon": ("build",),
    "bench": ("table1",),
    "compare": ("run", "run"),
    "csi": ("run",),
    "demo": (),
    "encode": ("data", "--radio", "wifi"),
    "export": ("run",),
    "import": ("a.dat",),
    "inspect": ("a.dat",),
    "limbs": ("--radio", "mmwave"),
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
        name
        for name, kind in kinds.items()
        if any(row.name == "out" for made in argument_classes(kind) for row in fields(made))
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
