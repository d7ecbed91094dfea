# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_channels.py` in a Python of their own, on a run of its own."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from rfgs_core.run import Run

ROOT = Path(__file__).parents[2]


def test_all_tests_of_channels_pass_inside_blender(
    pass_inside, small_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = shutil.copytree(small_run.path, tmp_path / "run")
    program = tmp_path / "python"
    program.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("RFGS_RUN", str(run))
    monkeypatch.setenv("RFGS_PYTHON", str(program))
    pass_inside("channels")
