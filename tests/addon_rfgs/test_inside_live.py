# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_live.py` in a Python of their own, on a dataset to replay."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_all_tests_of_live_clouds_pass_inside_blender(
    pass_inside: Callable[[str], None],
    tiny_dataset: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    program = tmp_path / "python"
    program.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("RFGS_DATASET", str(tiny_dataset))
    monkeypatch.setenv("RFGS_PYTHON", str(program))
    pass_inside("live")
