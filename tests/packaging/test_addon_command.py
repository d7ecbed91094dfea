# SPDX-License-Identifier: Apache-2.0
"""`rfgs addon`: the extension is built alike each time, and one command installs it."""

from __future__ import annotations

import os
import stat
import sys
import zipfile
from pathlib import Path

import pytest

from rfgs_core.cli import main
from rfgs_core.cli.addon import build_extension, source_folder


def test_the_archive_holds_the_add_on_and_nothing_of_tools(tmp_path: Path) -> None:
    first = build_extension(tmp_path)
    data = first.read_bytes()
    assert first.name == "addon_rfgs-0.1.0.zip"
    with zipfile.ZipFile(first) as archive:
        names = set(archive.namelist())
        for name in names:
            assert archive.read(name) == (source_folder() / name).read_bytes()
    assert {"blender_manifest.toml", "__init__.py", "tables.json", "jobs/panel.py"} <= names
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]
    assert build_extension(tmp_path).read_bytes() == data


def _stub(path: Path, body: str) -> Path:
    path.write_text(f"#!{sys.executable}\nimport os, sys\n{body}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_install_gives_blender_the_archive_and_this_environment(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program that stands where Blender would, and notes what it was asked."""
    note = tmp_path / "note"
    blender = _stub(
        tmp_path / "blender",
        f"with open({str(note)!r}, 'a') as out:\n"
        "    last = sys.argv[-1]\n"
        "    text = open(last).read() if last.endswith('.py') else str(os.path.isfile(last))\n"
        "    out.write(' '.join(sys.argv[1:-1]) + '|' + text + '\\n')\n"
        # Of an installation Blender says nothing on a busy machine.
        "print('rfgs-told' if last.endswith('.py') else 'Blender 5.2.2 LTS')",
    )
    assert main(["addon", "install", "--blender", str(blender)]) == 0
    asked = note.read_text()
    assert "extension install-file -r user_default -e|True" in asked
    prefix = sys.prefix if sys.prefix != sys.base_prefix else sys.executable
    assert f"stored.python = {prefix!r}" in asked and "save_userpref" in asked
    assert "choose the tab RF-GS" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("body", "words"),
    [("sys.exit(3)", "it said nothing"), ("print('Error: too old')", "Error: too old")],
)
def test_a_blender_that_does_not_install_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], body: str, words: str
) -> None:
    blender = _stub(tmp_path / "blender", body)
    assert main(["addon", "install", "--blender", str(blender)]) == 2
    err = capsys.readouterr().err
    assert err == f"error: {blender}: {words}\n"


def test_mistakes_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for arguments, words in (
        (["install", "--blender", str(tmp_path / "none")], "no such program"),
        (["install", "--out", str(tmp_path)], "use `rfgs addon build`"),
        (["build", "--blender", "x"], "needs none"),
    ):
        assert main(["addon", *arguments]) == 2
        err = capsys.readouterr().err
        assert words in err and err.count("\n") == 1
    assert not os.listdir(tmp_path)


def test_both_programs_say_their_version(capsys: pytest.CaptureFixture[str]) -> None:
    from dataset_factory.cli import main as factory

    assert main(["--version"]) == 0 and factory(["--version"]) == 0
    assert capsys.readouterr().out == "rfgs 0.1.0\nrfgs-factory 0.1.0\n"
