# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_channels.py` in a Python of their own, on a run of its own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rfgs_core.run import Run


def test_all_tests_of_channels_pass_inside_blender(
    pass_inside, small_run: Run, rfgs_python: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = shutil.copytree(small_run.path, tmp_path / "run")
    monkeypatch.setenv("RFGS_RUN", str(run))
    monkeypatch.setenv("RFGS_PYTHON", str(rfgs_python))
    pass_inside("channels")
