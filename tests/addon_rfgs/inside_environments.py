# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python environment that jobs run in; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from addon_rfgs.errors import AddonError
from addon_rfgs.jobs import environment
from addon_rfgs.jobs.preferences import version_lines


def test_interpreters_are_found_and_others_refused(tmp_path: Path) -> None:
    folder = tmp_path / "venv"
    (folder / "bin").mkdir(parents=True)
    (folder / "bin" / "python").symlink_to(sys.executable)
    assert environment.interpreter(str(folder)) == folder / "bin" / "python"
    assert environment.interpreter(str(folder / "bin" / "python")) == folder / "bin" / "python"
    (tmp_path / "text").write_text("")
    for path, words in (
        ("", "no Python environment is set"),
        (tmp_path, "no bin/python"),
        (tmp_path / "gone", "no such file"),
        (tmp_path / "text", "not a program"),
    ):
        with pytest.raises(AddonError, match=words):
            environment.interpreter(str(path))


@pytest.mark.parametrize(
    ("code", "output", "words"),
    [
        (None, "", "does not answer"),
        (1, "", "it said nothing"),
        (2, "ls: no such file", "ls: no such file"),
        (0, "rfgs-environment {", "no Python that works"),
        (0, 'rfgs-environment {"versions": [], "problems": []}', "no Python that works"),
        (0, 'rfgs-environment {"versions": {"rfgs": ""}, "problems": []}', "rfgs is not installed"),
    ],
)
def test_wrong_environments_are_explained(code, output: str, words: str) -> None:
    _, problems = environment.read_check(code, output)
    assert problems and words in problems[0] and "\n" not in problems[0]


def test_this_environment_is_ready() -> None:
    command = environment.check_arguments(Path(sys.executable))
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    versions, problems = environment.read_check(done.returncode, done.stdout)
    assert not problems and any(line.startswith("torch 2") for line in versions)


def test_versions_are_not_torn_from_their_programs() -> None:
    versions = ["Python 3.11.7", "rfgs 0.1.0", "sionna-rt 2.2.0", "torch 2.13.0+cpu", "bpy 4.5.15"]
    lines = version_lines(versions)
    assert lines == [
        "Python 3.11.7, rfgs 0.1.0,",
        "sionna-rt 2.2.0, torch 2.13.0+cpu,",
        "bpy 4.5.15",
    ]
    assert version_lines([]) == []


def test_a_blender_that_does_not_start_is_a_problem() -> None:
    command = environment.check_arguments(Path(sys.executable), "/nowhere/blender")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    _, problems = environment.read_check(done.returncode, done.stdout)
    assert len(problems) == 1 and "/nowhere/blender does not start" in problems[0]
