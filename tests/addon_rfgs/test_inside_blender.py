# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_*.py` in two Pythons: each start of one with Blender takes seconds."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from two_receivers import write_captures

from rfgs_core.run import Run

NAMES = sorted(
    path.stem.removeprefix("inside_") for path in Path(__file__).parent.glob("inside_*.py")
)


@pytest.mark.parametrize("half", [0, 1])
def test_all_tests_inside_blender_pass(
    pass_inside: Callable[..., None],
    small_run: Run,
    tiny_dataset: Path,
    rfgs_python: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    half: int,
) -> None:
    (tmp_path / "captures").mkdir()
    write_captures(tmp_path / "captures")
    given = {
        "RFGS_PYTHON": rfgs_python,
        "RFGS_DATASET": tiny_dataset,
        "RFGS_RUN": shutil.copytree(small_run.path, tmp_path / "run"),
        "RFGS_CAPTURES": tmp_path / "captures",
    }
    for name, value in given.items():
        monkeypatch.setenv(name, str(value))
    pass_inside(*NAMES[half::2])
