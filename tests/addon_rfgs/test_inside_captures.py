# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of `inside_captures.py` in a Python of their own, on captures made here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from two_receivers import write_captures


def test_all_tests_of_captures_pass_inside_blender(
    pass_inside: Callable[..., None],
    rfgs_python: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write_captures(tmp_path)
    monkeypatch.setenv("RFGS_CAPTURES", str(tmp_path))
    monkeypatch.setenv("RFGS_PYTHON", str(rfgs_python))
    pass_inside("captures")
